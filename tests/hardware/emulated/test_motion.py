import numpy as np
import pytest
from bolfi_liquids.hardware.emulated.motion import (
    JointState,
    MotionError,
    MountedArm,
    joint_speed,
    servo,
    twist,
)
from bolfi_liquids.hardware.motion.kinematics import UR10
from scipy.linalg import expm

HOME = np.array([0.3, -1.4, 1.6, -1.7, -1.5, 0.2])
ZERO = np.zeros(6)
DT = 0.008
MOUNTED = MountedArm(UR10, np.array([0, 0, 0.2, 0, 0, 0]))


@pytest.mark.parametrize(("lookahead", "gain"), [(0.03, 2000), (0.1, 300), (0.2, 100), (0.2, 2000)])
def test_servo_steps_are_those_of_its_equation(lookahead, gain):
    target = HOME + 1e-3
    system = np.array([[0.0, 1.0], [-gain, -gain * lookahead]])
    state = servo(UR10, target, lookahead, gain, 1e6).step(JointState(HOME, ZERO + 0.01), DT)
    away, speed = expm(system * DT) @ [-1e-3, 0.01]
    assert state.joints == pytest.approx(target + away, abs=1e-9)
    assert state.speed == pytest.approx(ZERO + speed, abs=1e-7)


def test_servo_lags_a_moving_target_by_its_lookahead():
    state, speed = JointState(HOME, ZERO), 0.1
    for k in range(1, 500):
        target = HOME + speed * k * DT
        state = servo(UR10, target, 0.1, 300, 15.0).step(state, DT)
    # the target of a tick stands still during it: half a tick more
    lag = (target - state.joints) / speed
    assert lag == pytest.approx(ZERO + 0.1, abs=DT)


def test_servo_keeps_to_the_joints_speeds_and_rests_on_its_target():
    target, state, speeds = HOME + [2, 0, 0, 0, 0, 0], JointState(HOME, ZERO), []
    motion = servo(UR10, target, 0.1, 300, 15.0)
    for _ in range(1000):
        state = motion.step(state, DT)
        speeds.append(state.speed)
    rates = np.diff(speeds, axis=0) / DT
    assert np.abs(speeds).max() <= UR10.joint_speed[0]
    assert np.abs(rates).max() < 15.0 + 1e-6
    assert state.joints == pytest.approx(target)
    assert not state.speed.any()


def test_twist_moves_the_tcp_straight_and_stops_it():
    state, rate = JointState(HOME, ZERO), 0.5
    start = MOUNTED.pose(HOME)
    for _ in range(50):
        state = twist(MOUNTED, np.array([0.05, 0, 0, 0, 0, 0]), rate).step(state, DT)
    assert MOUNTED.jacobian(state.joints) @ state.speed == pytest.approx(
        [0.05, 0, 0, 0, 0, 0], abs=1e-5
    )
    shift = MOUNTED.pose(state.joints) - start
    # 0.1 s of ramp, 0.3 s at full speed
    assert shift[:3] == pytest.approx([0.05 * 0.35, 0, 0], abs=2e-4)
    before = MOUNTED.pose(state.joints)
    stop = twist(MOUNTED, ZERO, rate, ends=True)
    for _ in range(13):
        state = stop.step(state, DT)
    assert not state.speed.any()
    assert (MOUNTED.pose(state.joints) - before)[:3] == pytest.approx([0.0025, 0, 0], abs=2e-4)


def test_joint_speeds_reach_their_target_together():
    target = np.array([0.2, -0.1, 0, 0, 0, 0.4])
    state = joint_speed(target, 1.0).step(JointState(HOME, ZERO), 0.1)
    assert state.speed == pytest.approx(target / 4)
    assert state.joints == pytest.approx(HOME + target / 4 * 0.05)


def test_impossible_motions_are_refused():
    nan = np.full(6, np.nan)
    for make in (
        lambda: servo(UR10, nan, 0.1, 300, 15.0),
        lambda: twist(MOUNTED, nan, 0.5),
        lambda: joint_speed(ZERO, -1.0),
    ):
        with pytest.raises(MotionError):
            make()
