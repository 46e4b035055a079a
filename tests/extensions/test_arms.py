"""What every arm must do: those of the package, the example's, and one of your own.

`pytest tests/extensions --arm your_module:YourController` adds the last to each test. It is called
with the joints at the start [rad], and a clock with `now` and `sleep` by which the arm must go.
"""

import sys
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.hardware import MotionRejected, bundled_rig, emulated
from bolfi_liquids.hardware.arm import (
    LOOKAHEAD,
    WATCHDOG_PERIOD,
    ArmReader,
    Controller,
    LinkLost,
    PathFollower,
)
from bolfi_liquids.hardware.motion import stir
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.robot import ur
from bolfi_liquids.hardware.safety.guards import NORMAL, PLAYING, RUNNING_MODE

from .delayed_arm import DelayedArm
from .named import named

sys.path.insert(0, str(Path(__file__).parents[1] / "hardware"))
from stepped_clock import SteppedClock  # noqa: E402
from ur_controller.machine import Options  # noqa: E402
from ur_controller.stepped import AtOnce, SteppedController, library  # noqa: E402

RIG = bundled_rig()
STIR = stir(RIG)
PATH = cup_frame(RIG.cup).to_base(STIR.pose)
PERIOD = 1.0 / RIG.robot.rate
MOVING = int(np.flatnonzero(np.linalg.norm(PATH[:, :3] - PATH[0, :3], axis=1) > 1e-3)[0])


def pytest_generate_tests(metafunc):
    if "controller" in metafunc.fixturenames:
        own = metafunc.config.getoption("arm", default="")
        names = ["emulated", "ur", "example", *([own] if own else [])]
        metafunc.parametrize("controller", names, indirect=True)


@pytest.fixture
def clock():
    return SteppedClock()


@pytest.fixture
def controller(request, clock, monkeypatch):
    """Opens an arm at rest where the stir begins."""
    mine = emulated(RIG, STIR.pose[0]).controller._replace(clock=clock, begun=clock.now())
    if request.param == "emulated":
        return mine
    if request.param == "ur":
        options = Options(joints=mine.joints, tcp=RIG.robot.stirring_tcp)
        emulator = SteppedController(options, clock)
        for module in ("rtde_receive", "rtde_control"):
            monkeypatch.setitem(sys.modules, module, library(emulator))
        monkeypatch.setattr(ur, "Thread", AtOnce)
        return ur.URController(emulator.address)
    if request.param == "example":
        return DelayedArm(mine.joints, clock)
    return named(request.param)(mine.joints, clock)


@pytest.fixture
def follower(controller, clock):
    arm = controller.follower(RIG, "stirring")
    arm.connect()
    arm.take_control()
    clock.sleep(5 * PERIOD)
    yield arm
    arm.stop()
    arm.close()


def follow(arm, clock, poses):
    for pose in poses:
        arm.command(pose)
        clock.sleep(PERIOD)


def rests_within(arm, clock, seconds):
    """Whether it comes to rest in that time, and then stays so for a second."""
    clock.sleep(seconds)
    there = arm.read()
    clock.sleep(1.0)
    return there.speed < 1e-6 and arm.read().joints == pytest.approx(there.joints, abs=1e-9)


def test_a_reader_sees_an_arm_that_goes_on_in_time_and_rests(controller, clock):
    reader = controller.reader(RIG)
    reader.connect()
    before = reader.read()
    clock.sleep(10 * PERIOD)
    after = reader.read()
    assert after.time - before.time == pytest.approx(10 * PERIOD, abs=1.01 * PERIOD)
    assert reader.time() == after.time
    assert after.pose == pytest.approx(PATH[0], abs=1e-6) and after.speed == 0.0
    assert (after.connected, after.robot_mode, after.safety_bits) == (True, RUNNING_MODE, NORMAL)
    # no program that could move it
    assert after.runtime_state != PLAYING and reader.payload().mass == 0.0
    reader.close()
    reader.close()


def test_the_reader_of_a_real_arm_has_no_way_to_move_it():
    reader = ur.URController("127.0.0.1").reader(RIG)
    assert not hasattr(reader, "command") and not hasattr(reader, "stop")


@pytest.mark.parametrize("kind", [ArmReader, PathFollower, Controller])
def test_an_arm_that_lacks_something_cannot_be_made(kind):
    """It would not stop, and nobody would be told."""
    asked = [name for name in dir(kind) if not name.startswith("_")]
    for name in asked:
        others = {other: None for other in asked if other != name}
        with pytest.raises(TypeError, match=f"abstract method '{name}'"):
            type("Lacking", (kind,), others)()


def test_taking_control_sets_tool_and_payload_and_moves_nothing(follower):
    state = follower.read()
    assert state.runtime_state == PLAYING
    assert follower.tcp() == pytest.approx(RIG.robot.stirring_tcp)
    assert follower.payload() == (RIG.robot.payload, RIG.robot.payload_centre)
    assert state.pose == pytest.approx(PATH[0], abs=1e-6) and state.speed == 0.0


def test_set_points_are_followed_with_the_lag_that_was_told(follower, clock):
    follower.arm_watchdog()
    follow(follower, clock, PATH[: MOVING + 30])
    here, last = np.array(follower.read().pose[:3]), MOVING + 29
    lagging = np.linalg.norm(PATH[last - round(LOOKAHEAD / PERIOD), :3] - here)
    assert lagging < 2e-3 < 5e-3 < np.linalg.norm(PATH[last, :3] - here)


def test_a_set_point_that_breaks_a_limit_moves_nothing(follower, clock):
    with pytest.raises(MotionRejected):  # the first must be where the arm is
        follower.command(PATH[0] + [0.003, 0, 0, 0, 0, 0])
    follow(follower, clock, PATH[:5])
    for wrong in (np.nan, 0.06, 0.002):
        with pytest.raises(MotionRejected):
            follower.command(PATH[5] + [wrong, 0, 0, 0, 0, 0])
    clock.sleep(0.5)
    assert follower.read().pose == pytest.approx(PATH[5], abs=1e-6)
    # the next is held against the last that was taken, not against what was refused
    follower.command(PATH[5])


def test_without_set_points_the_watchdog_stops_the_arm_for_good(follower, clock):
    follower.arm_watchdog()
    follow(follower, clock, PATH[: MOVING + 30])
    clock.sleep(WATCHDOG_PERIOD - 3 * PERIOD)
    assert follower.read().runtime_state == PLAYING and follower.read().speed > 0.0
    for _ in range(8):  # looks keep no watchdog quiet
        clock.sleep(PERIOD)
        follower.read()
    assert follower.read().runtime_state != PLAYING
    assert rests_within(follower, clock, 0.1)
    with pytest.raises(LinkLost):
        follower.command(PATH[MOVING + 30])


def test_without_a_watchdog_it_goes_to_the_last_set_point_and_waits(follower, clock):
    follow(follower, clock, PATH[: MOVING + 30])
    for _ in range(100):
        clock.sleep(PERIOD)
        state = follower.read()
    assert state.runtime_state == PLAYING
    assert state.pose[:3] == pytest.approx(PATH[MOVING + 29, :3], abs=1e-5)


def test_a_stop_is_final(follower, clock):
    follower.arm_watchdog()
    follow(follower, clock, PATH[: MOVING + 30])
    follower.stop()
    with pytest.raises(LinkLost):
        follower.command(PATH[MOVING + 30])
    assert rests_within(follower, clock, 0.15)
    assert follower.read().runtime_state != PLAYING
    follower.stop()
    follower.give_up()


def test_an_arm_that_is_given_up_at_rest_takes_nothing(follower, clock):
    follower.give_up()
    with pytest.raises(LinkLost):
        follower.command(PATH[0])
    assert rests_within(follower, clock, 0.1)


def test_poses_out_of_reach_are_not_allowed(follower):
    assert follower.allows(PATH[0])
    assert not follower.allows(np.array([3.0, 0.0, 0.2, np.pi, 0.0, 0.0]))
