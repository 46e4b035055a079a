"""The emulated arm alone: stalls, protective stops, the force, and what cameras see of it."""

import numpy as np
import pytest
from bolfi_liquids.hardware import HiddenLiquid, StickMotion, bundled_rig, emulated, servoed
from bolfi_liquids.hardware.arm import LinkLost
from bolfi_liquids.hardware.emulated.arm import FORCE_NOISE, MAX_LATENESS
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.pour_paths import ready_to_pour
from bolfi_liquids.hardware.motion.stir_paths import stir, strokes
from bolfi_liquids.hardware.safety.guards import PLAYING
from stepped_clock import SteppedClock

RIG = bundled_rig()
# a cup whose axes are not those of the base
TURNED = RIG.model_copy(update={"cup": RIG.cup.model_copy(update={"yaw_deg": 30.0})})
STIR = stir(TURNED)
PATH = cup_frame(TURNED.cup).to_base(STIR.pose)
PERIOD = 1.0 / RIG.robot.rate
SOON = int(np.flatnonzero(np.linalg.norm(PATH[:, :3] - PATH[0, :3], axis=1) > 0.02)[0])


def opened(controller, rig=TURNED):
    """Its arm under control, and the clock by which that moves."""
    clock = SteppedClock(controller.begun)
    arm = controller._replace(clock=clock).follower(rig, "stirring")
    arm.connect()
    arm.take_control()
    return arm, clock


@pytest.fixture
def arm_and_clock():
    return opened(emulated(TURNED, STIR.pose[0]).controller)


def follow(arm, clock, poses):
    for pose in poses:
        arm.command(pose)
        clock.sleep(PERIOD)
        arm.read()


def test_a_stall_of_the_process_is_left_out_and_the_watchdog_does_not_count_it(arm_and_clock):
    arm, clock = arm_and_clock
    arm.arm_watchdog()
    follow(arm, clock, PATH[:SOON])
    before, stall = arm.read(), 0.8
    clock.sleep(stall)
    after = arm.read()
    # its clock keeps up with the computer's, as a controller's does
    assert after.time - before.time == pytest.approx(stall, abs=PERIOD)
    assert after.runtime_state == PLAYING
    gone = np.linalg.norm(np.subtract(after.pose[:3], before.pose[:3]))
    assert gone < 0.1 * (MAX_LATENESS + PERIOD)
    follow(arm, clock, PATH[SOON : SOON + 60])
    assert arm.read().runtime_state == PLAYING


def test_what_the_arm_cannot_do_is_a_protective_stop(arm_and_clock, monkeypatch):
    arm, clock = arm_and_clock
    follow(arm, clock, PATH[:SOON])
    away = np.array([3.0, 0.0, 0.2, np.pi, 0.0, 0.0])
    monkeypatch.setattr(arm, "_check", lambda *_: None)  # which would have refused it before
    arm.command(away)
    state = arm.read()
    assert state.safety_bits & 1 << 2 and not state.safety_bits & 1
    assert state.runtime_state != PLAYING
    clock.sleep(0.1)
    assert arm.read().speed == 0.0
    with pytest.raises(LinkLost):
        arm.command(PATH[SOON])


def test_the_force_is_noise_of_its_seed():
    def readings(seed):
        controller = emulated(TURNED, STIR.pose[0], liquid=HiddenLiquid(seed=seed)).controller
        (arm, clock), found = opened(controller), []
        for _ in range(1000):
            clock.sleep(PERIOD)
            found.append(arm.read().wrench)
        return np.array(found)

    one, same, other = readings(1), readings(1), readings(2)
    np.testing.assert_array_equal(one, same)
    assert (one != other).all()
    # standard errors of a mean and of a standard deviation of 1000, five times
    assert np.abs(one.mean(axis=0) / FORCE_NOISE).max() < 5 / np.sqrt(1000)
    assert one.std(axis=0) / FORCE_NOISE == pytest.approx(np.ones(6), abs=5 / np.sqrt(2000))


def test_cameras_see_where_the_stick_is_and_how_it_hangs():
    lean = np.column_stack([0.01 * STIR.time, -0.02 * STIR.time])
    motion = StickMotion(STIR.time, servoed(STIR).position, lean)
    rig = emulated(TURNED, STIR.pose[0], liquid=HiddenLiquid(stir=motion))
    arm, clock = opened(rig.controller)
    follow(arm, clock, PATH)
    state = arm.read()
    seen = rig.controller.world.state(clock.now())
    assert seen.time == pytest.approx(state.time)
    assert seen.pivot == pytest.approx(cup_frame(TURNED.cup).from_base(np.array(state.pose))[:3])
    # at the end of the path, where the table ends
    assert seen.inclination == pytest.approx(lean[-1], abs=2e-3)

    # a stick of which nothing is known hangs straight down
    plain = emulated(TURNED, STIR.pose[0])
    arm, clock = opened(plain.controller)
    follow(arm, clock, PATH[:SOON])
    seen = plain.controller.world.state(clock.now())
    assert (seen.inclination == 0.0).all() and seen.pivot[0] != pytest.approx(STIR.pose[0, 0])


def test_a_pose_out_of_reach_is_refused_and_a_pouring_arm_has_no_cameras():
    with pytest.raises(RigError, match="cup.position"):
        emulated(RIG, STIR.pose[0] + [3.0, 0, 0, 0, 0, 0])
    rig = emulated(RIG, ready_to_pour(RIG, 0.03, 0.2), tool="pouring")
    assert not rig.make_cameras and rig.controller.world is None


@pytest.mark.parametrize(("kind", "rate"), [("cb3", 125.0), ("e-series", 500.0)])
def test_the_arm_that_is_servoed_along_a_stir_is_where_it_was_reckoned(kind, rate):
    robot = RIG.robot.model_copy(update={"controller": kind, "rate": rate})
    rig, frame = RIG.model_copy(update={"robot": robot}), cup_frame(RIG.cup)
    path = strokes(rig)[0]
    arm, clock = opened(emulated(rig, path.pose[0]).controller, rig)
    way = []
    for pose in frame.to_base(path.pose):
        arm.command(pose)
        clock.sleep(1.0 / rate)
        way.append(arm.read().pose)
    found = frame.from_base(np.array(way))[:, :3]
    off = np.linalg.norm(found - servoed(path).position, axis=1)
    assert off.max() < 1e-4
    # against a path that was not servoed
    assert np.linalg.norm(found - path.pose[:, :3], axis=1).max() > 5e-3
