import numpy as np
import pytest
from bolfi_liquids.hardware.emulated.motion import (
    REST,
    JointState,
    KinematicArm,
    MotionError,
    braked,
    servo,
)
from bolfi_liquids.hardware.motion.kinematics import UR10
from scipy.linalg import expm

HOME = np.array([0.3, -1.4, 1.6, -1.7, -1.5, 0.2])
TCP = np.array([0, 0, 0.2, 0, 0, 0])
DT = 0.008
FASTEST = np.array(UR10.joint_speed)


def drawn(state, target, lookahead=0.1, gain=300.0, fastest=FASTEST, dt=DT):
    return servo(state, dt, target=target, lookahead=lookahead, gain=gain, fastest=fastest)


@pytest.mark.parametrize(("lookahead", "gain"), [(0.1, 300), (0.2, 100)])  # one is critical
def test_servo_steps_are_those_of_its_equation(lookahead, gain):
    # so near that no acceleration is clipped
    target = HOME + 1e-4
    system = np.array([[0.0, 1.0], [-gain, -gain * lookahead]])
    state = drawn(JointState(HOME, REST + 1e-3), target, lookahead, gain)
    away, speed = expm(system * DT) @ [-1e-4, 1e-3]
    assert state.joints == pytest.approx(target + away, abs=1e-10)
    assert state.speed == pytest.approx(REST + speed, abs=1e-8)


def test_servo_lags_a_moving_target_by_its_lookahead():
    state, speed = JointState(HOME, REST), 0.1
    for k in range(1, 500):
        target = HOME + speed * k * DT
        state = drawn(state, target)
    # the target of a tick stands still during it: half a tick more
    lag = (target - state.joints) / speed
    assert lag == pytest.approx(REST + 0.1, abs=DT)


def test_servo_keeps_to_the_joints_speeds_and_rests_on_its_target():
    target, state, speeds = HOME + [2, 0, 0, 0, 0, 0], JointState(HOME, REST), []
    for _ in range(1000):
        state = drawn(state, target)
        speeds.append(state.speed)
    rates = np.diff(speeds, axis=0) / DT
    assert np.abs(speeds).max() <= UR10.joint_speed[0]
    assert np.abs(rates).max() < 15.0 + 1e-6
    assert state.joints == pytest.approx(target)
    assert not state.speed.any()


def test_joints_come_to_rest_together():
    speed = np.array([0.2, -0.1, 0, 0, 0, 0.4])
    for velocity in ([0.0, 0.4, 0.0, 0.0, 0.0, 0.2], [0.0, 0.2, 0.0, 0.0, 0.0, 0.4]):
        state = braked(JointState(HOME, speed), np.array(velocity), 0.1, 1.0)
        assert state.speed == pytest.approx(0.75 * speed)
        assert state.joints == pytest.approx(HOME + 0.1 * 0.875 * speed)
    # also where the joints' speeds cancel at the TCP
    for velocity in (np.full(6, 0.01), REST):
        assert not braked(state, velocity, 0.1, 1.0).speed.any()


@pytest.mark.parametrize("deceleration", [3.0, 1.0])
def test_a_stopped_arm_rests_after_what_its_tcp_s_deceleration_takes_and_stays(deceleration):
    arm = KinematicArm(UR10, HOME + [0, 0.4, -0.8, 0.4, 0, 0], TCP)
    arm.follow(arm.pose + [0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    for _ in range(30):
        arm.tick(DT)
    speed = np.linalg.norm(arm.velocity[:3])
    assert speed > 0.05 and not arm.resting
    arm.stop(deceleration)
    ticks = 0
    while not arm.resting:
        arm.tick(DT)
        ticks += 1
    assert ticks * DT == pytest.approx(speed / deceleration, abs=2 * DT)
    there = arm.pose
    arm.tick(DT)
    assert (arm.pose == there).all() and not arm.velocity.any()


def test_the_tcp_s_velocity_is_that_of_its_pose():
    arm, poses = KinematicArm(UR10, HOME, TCP), []
    arm.follow(arm.pose + [0.05, 0.02, 0.1, 0.0, 0.0, 0.0])
    for _ in range(300):
        arm.tick(1e-4)
        poses.append(arm.pose)
    moved = (poses[-1] - poses[-3])[:3] / 2e-4
    assert arm.velocity[:3] == pytest.approx(moved, rel=0.01)


def test_impossible_motions_are_refused():
    arm = KinematicArm(UR10, HOME, TCP)
    for pose in (np.full(6, np.nan), np.array([3.0, 0, 0, 0, 0, 0])):
        assert not arm.reaches(pose)
        with pytest.raises(MotionError, match="no joints"):
            arm.follow(pose)
    # a target so far away that all joints hurry to it
    arm.follow(arm.pose * [-1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    with pytest.raises(MotionError, match="faster than 1.5 m/s"):
        for _ in range(1000):
            arm.tick(DT)
