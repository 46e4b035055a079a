import numpy as np
import pytest
from bolfi_liquids.hardware.emulator.arm import Arm
from bolfi_liquids.hardware.emulator.motion import (
    JointState,
    MotionError,
    Tool,
    Trapezoid,
    joint_move,
    joint_speed,
    line,
    servo,
    twist,
)
from bolfi_liquids.hardware.motion.kinematics import UR10
from scipy.linalg import expm

HOME = np.array([0.3, -1.4, 1.6, -1.7, -1.5, 0.2])
ZERO = np.zeros(6)
DT = 0.008
TOOL = Tool(UR10, np.array([0, 0, 0.2, 0, 0, 0]))


@pytest.mark.parametrize("length", [1e-6, 0.01, 0.5])
def test_trapezoid_is_smooth_and_within_its_limits(length):
    profile = Trapezoid(length, 0.1, 0.5)
    times = np.linspace(0.0, profile.duration, 20001)
    way = length * np.array([profile.share(t) for t in times])
    speed = np.gradient(way, times)
    assert way[0] == 0.0
    assert way[-1] == pytest.approx(length)
    assert -1e-9 < speed.min()
    assert speed.max() < 0.1 * (1 + 1e-6)
    assert np.abs(np.gradient(speed, times)[2:-2]).max() < 0.5 * (1 + 1e-3)


def test_no_way_takes_no_time():
    assert Trapezoid(0.0, 0.1, 0.5).duration == 0.0
    assert Trapezoid(0.0, 0.1, 0.5).share(0.0) == 1.0


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
    start = TOOL.pose(HOME)
    for _ in range(50):
        state = twist(TOOL, np.array([0.05, 0, 0, 0, 0, 0]), rate).step(state, DT)
    assert TOOL.jacobian(state.joints) @ state.speed == pytest.approx(
        [0.05, 0, 0, 0, 0, 0], abs=1e-5
    )
    shift = TOOL.pose(state.joints) - start
    # 0.1 s of ramp, 0.3 s at full speed
    assert shift[:3] == pytest.approx([0.05 * 0.35, 0, 0], abs=2e-4)
    before = TOOL.pose(state.joints)
    stop = twist(TOOL, ZERO, rate, ends=True)
    for _ in range(13):
        state = stop.step(state, DT)
    assert not state.speed.any()
    assert (TOOL.pose(state.joints) - before)[:3] == pytest.approx([0.0025, 0, 0], abs=2e-4)


def test_joint_speeds_reach_their_target_together():
    target = np.array([0.2, -0.1, 0, 0, 0, 0.4])
    state = joint_speed(UR10, target, 1.0).step(JointState(HOME, ZERO), 0.1)
    assert state.speed == pytest.approx(target / 4)
    assert state.joints == pytest.approx(HOME + target / 4 * 0.05)


def test_impossible_motions_are_refused():
    nan = np.full(6, np.nan)
    for make in (
        lambda: line(TOOL, HOME, nan, 0.1, 0.5),
        lambda: line(TOOL, HOME, np.array([3.0, 0, 0, 0, 0, 0]), 0.1, 0.5),
        lambda: line(TOOL, HOME, TOOL.pose(HOME), 0.0, 0.5),
        lambda: joint_move(UR10, HOME, nan, 0.1, 0.5),
        lambda: joint_move(UR10, HOME, ZERO + 7.0, 0.1, 0.5),
        lambda: servo(UR10, nan, 0.1, 300, 15.0),
        lambda: twist(TOOL, nan, 0.5),
        lambda: joint_speed(UR10, ZERO, -1.0),
    ):
        with pytest.raises(MotionError):
            make()


def run(arm, most=1000):
    for _ in range(most):
        arm.tick(DT)
        if not arm.busy:
            return
    raise AssertionError("the arm did not come to its end")


def test_plans_follow_each_other_and_begin_from_rest():
    arm = Arm(UR10, HOME)
    goals = [HOME + 0.05, HOME - 0.05]
    plans = [
        lambda state, goal=goal: joint_move(UR10, state.joints, goal, 0.5, 2.0) for goal in goals
    ]
    arm.begin(plans)
    for _ in range(20):
        arm.tick(DT)
    assert arm.index == 0
    run(arm)
    assert arm.index == 2
    assert arm.state.joints == pytest.approx(goals[-1])
    arm.tick(DT)
    assert arm.resting
    arm.begin([lambda state: joint_speed(UR10, ZERO + 0.2, 5.0)])
    for _ in range(20):
        arm.tick(DT)
    arm.begin([lambda state: joint_move(UR10, state.joints, HOME, 0.5, 2.0)], brake=3.0)
    arm.tick(DT)
    assert arm.index == -1  # it comes to rest before the move begins
    run(arm)
    assert arm.state.joints == pytest.approx(HOME)


def test_a_line_through_a_singular_arm_is_refused_before_a_joint_is_too_fast():
    near_wrist = np.array([0.3, -1.4, 1.6, -1.7, -0.05, 0.2])
    arm = Arm(UR10, near_wrist)
    goal = arm.pose + [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    goal[:3] += 0.3 * np.array([np.sin(0.3), -np.cos(0.3), 0.0])
    arm.begin([lambda state: line(arm.tool, state.joints, goal, 1.4, 50.0)])
    fastest = 0.0
    with pytest.raises(MotionError, match="too fast|no joints"):
        for _ in range(1000):
            arm.tick(DT)
            fastest = max(fastest, (np.abs(arm.state.speed) / UR10.joint_speed).max())
            if not arm.busy:
                break
    assert fastest <= 1.0


def test_motions_are_counted_from_rest_to_rest():
    arm = Arm(UR10, HOME)
    for k in range(3):
        assert arm.started == k
        arm.begin([lambda state: joint_move(UR10, state.joints, state.joints + 0.01, 0.5, 2.0)])
        run(arm)
        arm.tick(DT)
