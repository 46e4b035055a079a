"""The emulator's own times: watchdog, unlocking, faults of the link; on a clock that is stepped."""

from itertools import pairwise

import numpy as np
import pytest
from bolfi_liquids.hardware.robot.ur import RTDE_FIELDS
from stepped_clock import SteppedClock
from ur_controller.controller import MODELS

HOME = (0.3, -1.4, 1.6, -1.7, -1.5, 0.2)
DT = 0.008


@pytest.fixture
def clock():
    return SteppedClock()


@pytest.fixture
def emulator(step_emulator, clock):
    return step_emulator(clock, joints=HOME, unlock_after=5.0)


@pytest.fixture
def receive(emulator):
    return __import__("rtde_receive").RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)


@pytest.fixture
def control(emulator):
    interface = __import__("rtde_control").RTDEControlInterface
    return interface(emulator.address, 125.0, interface.FLAG_UPLOAD_SCRIPT)


def time_to(clock, condition, within=3.0):
    """Until something is so [s]; infinite if it never is."""
    start = clock.now()
    while clock.now() < start + within:
        if condition():
            return clock.now() - start
        clock.sleep(DT)
    return float("inf")


def move(control, clock, emulator, seconds):
    """Set-points upwards at 0.05 m/s, one a period, as our loop sends them."""
    pose = np.array(emulator.controller.snapshot.pose)
    for _ in range(round(seconds / DT)):
        pose[2] += 0.05 * DT
        assert control.servoL(pose.tolist(), 0.5, 0.5, DT, 0.1, 300)
        clock.sleep(DT)


@pytest.mark.parametrize("kind", MODELS)
def test_the_robot_s_clock_is_the_host_s(step_emulator, clock, kind):
    emulator = step_emulator(clock, controller=kind)
    receive = __import__("rtde_receive").RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)
    before, since = receive.getTimestamp(), clock.now()
    clock.sleep(10.0)
    assert receive.getTimestamp() - before == pytest.approx(clock.now() - since, abs=DT)


def test_ticks_that_come_late_are_left_out_and_the_watchdog_does_not_count_them(
    control, clock, emulator, capfd
):
    control.setWatchdog(10.0)
    move(control, clock, emulator, 0.5)
    before, height = emulator.controller.snapshot.time, emulator.controller.snapshot.pose[2]
    assert emulator.turn(clock.now() - 0.5) == pytest.approx(clock.now(), abs=DT)
    assert "62 ticks late, left out" in capfd.readouterr().err
    move(control, clock, emulator, 3 * DT)
    snapshot = emulator.controller.snapshot
    assert snapshot.time - before == pytest.approx((62 + 4) * DT)
    assert snapshot.runtime_state == 2
    assert snapshot.pose[2] - height < 0.05 * 5 * DT


def test_a_tick_that_is_a_little_late_is_made_up_for(clock, emulator):
    assert emulator.turn(clock.now() - 0.04) == clock.now() - 0.04


@pytest.mark.parametrize("frequency", [10.0, 5.0])
def test_the_watchdog_ends_the_program_after_its_period(control, clock, emulator, frequency):
    control.setWatchdog(frequency)
    move(control, clock, emulator, 1.0)
    assert not emulator.controller.snapshot.resting
    ended = time_to(clock, lambda: emulator.controller.snapshot.runtime_state == 1)
    assert 1.0 / frequency < ended <= 1.0 / frequency + 2 * DT
    assert f"not written for {1 / frequency:.3f} s" in emulator.controller.reason
    assert time_to(clock, lambda: emulator.controller.snapshot.resting) < 0.1
    clock.sleep(1.0)
    assert emulator.controller.started == 1


def test_without_a_watchdog_the_program_goes_on(control, clock, emulator):
    move(control, clock, emulator, 0.5)
    clock.sleep(5.0)
    assert emulator.controller.snapshot.runtime_state == 2


def test_the_watchdog_goes_on_behind_a_frozen_link_and_what_comes_late_moves_nothing(
    control, clock, emulator
):
    control.setWatchdog(10.0)
    move(control, clock, emulator, 0.5)
    emulator.network.freeze(0.6)
    control.servoL(list(emulator.controller.snapshot.pose), 0.5, 0.5, DT, 0.1, 300)
    assert time_to(clock, lambda: emulator.controller.snapshot.resting) < 0.25
    clock.sleep(1.0)
    assert "watchdog" in emulator.controller.reason
    assert emulator.controller.started == 1


def test_a_protective_stop_is_unlocked_after_its_time_and_nothing_resumes(control, clock, emulator):
    controller = emulator.controller
    move(control, clock, emulator, 0.5)
    controller.protective_stop("by the test")
    assert time_to(clock, lambda: controller.snapshot.resting) < 0.1
    assert (controller.snapshot.safety_bits & 0b101, controller.snapshot.runtime_state) == (4, 1)
    waited = time_to(clock, controller.unlock, within=10.0)
    assert 4.8 < waited <= 5.0
    clock.sleep(1.0)
    assert (controller.snapshot.safety_bits, controller.snapshot.runtime_state) == (1, 1)
    assert controller.started == 1


def test_a_frozen_link_keeps_its_last_value_and_looks_sound(receive, clock, emulator):
    held = receive.getTimestamp()
    emulator.network.freeze(0.4)
    clock.sleep(0.39)
    assert receive.getTimestamp() == held
    assert receive.isConnected()
    clock.sleep(0.1)
    assert receive.getTimestamp() > held + 0.4
    emulator.network.drop()
    assert not receive.isConnected()
    held = receive.getTimestamp()
    clock.sleep(0.1)
    assert receive.getTimestamp() == held


def test_late_packages_are_late_and_keep_their_order(receive, clock, emulator):
    def lag():
        return emulator.controller.snapshot.time - receive.getTimestamp()

    emulator.faults.late = 0.15
    clock.sleep(0.3)
    assert lag() == pytest.approx(0.15, abs=DT)
    emulator.faults.late = 0.0
    times = []
    for _ in range(40):
        clock.sleep(DT)
        times.append(receive.getTimestamp())
    assert lag() < DT
    # the late ones come first
    assert all(later >= earlier for earlier, later in pairwise(times))


def test_set_points_on_a_circle_are_followed(control, clock, emulator):
    start, radius, speed, rows = np.array(emulator.controller.snapshot.pose), 0.025, 0.05, []
    centre = start[:2] - [radius, 0.0]
    for k in range(125):
        angle = speed / radius * k * DT
        turned = [radius * (np.cos(angle) - 1), radius * np.sin(angle), 0.0, 0.0, 0.0, 0.0]
        assert control.servoL((start + turned).tolist(), 0.5, 0.5, DT, 0.03, 2000)
        clock.sleep(DT)
        rows.append(emulator.controller.snapshot.pose[:3])
    off = np.linalg.norm(np.array(rows)[:, :2] - centre, axis=1) - radius
    assert np.abs(off).max() < 0.2e-3
    assert np.ptp(np.array(rows)[:, 2]) < 0.2e-3
    # it lags by what it looks ahead
    lag = np.linalg.norm(np.array(rows[-1]) - (start + turned)[:3]) / speed
    assert lag == pytest.approx(0.03, abs=2 * DT)
