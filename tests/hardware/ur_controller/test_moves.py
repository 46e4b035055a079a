import numpy as np
import pytest
from bolfi_liquids.hardware.emulated.motion import MotionError, MountedArm, joint_speed
from bolfi_liquids.hardware.motion.kinematics import UR10
from ur_controller.moves import Trapezoid, joint_move, line
from ur_controller.queued_arm import QueuedArm

HOME = np.array([0.3, -1.4, 1.6, -1.7, -1.5, 0.2])
ZERO = np.zeros(6)
DT = 0.008
MOUNTED = MountedArm(UR10, np.array([0, 0, 0.2, 0, 0, 0]))


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


def test_impossible_motions_are_refused():
    nan = np.full(6, np.nan)
    for make in (
        lambda: line(MOUNTED, HOME, nan, 0.1, 0.5),
        lambda: line(MOUNTED, HOME, np.array([3.0, 0, 0, 0, 0, 0]), 0.1, 0.5),
        lambda: line(MOUNTED, HOME, MOUNTED.pose(HOME), 0.0, 0.5),
        lambda: joint_move(UR10, HOME, nan, 0.1, 0.5),
        lambda: joint_move(UR10, HOME, ZERO + 7.0, 0.1, 0.5),
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
    arm = QueuedArm(UR10, HOME)
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
    arm.begin([lambda state: joint_speed(ZERO + 0.2, 5.0)])
    for _ in range(20):
        arm.tick(DT)
    arm.begin([lambda state: joint_move(UR10, state.joints, HOME, 0.5, 2.0)], brake=3.0)
    arm.tick(DT)
    assert arm.index == -1  # it comes to rest before the move begins
    run(arm)
    assert arm.state.joints == pytest.approx(HOME)


def test_a_line_through_a_singular_arm_is_refused_before_a_joint_is_too_fast():
    near_wrist = np.array([0.3, -1.4, 1.6, -1.7, -0.05, 0.2])
    arm = QueuedArm(UR10, near_wrist)
    goal = arm.pose + [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    goal[:3] += 0.3 * np.array([np.sin(0.3), -np.cos(0.3), 0.0])
    arm.begin([lambda state: line(arm.mounted, state.joints, goal, 1.4, 50.0)])
    fastest = 0.0
    with pytest.raises(MotionError, match="too fast|no joints"):
        for _ in range(1000):
            arm.tick(DT)
            fastest = max(fastest, (np.abs(arm.state.speed) / UR10.joint_speed).max())
            if not arm.busy:
                break
    assert fastest <= 1.0


def test_motions_are_counted_from_rest_to_rest():
    arm = QueuedArm(UR10, HOME)
    for k in range(3):
        assert arm.started == k
        arm.begin([lambda state: joint_move(UR10, state.joints, state.joints + 0.01, 0.5, 2.0)])
        run(arm)
        arm.tick(DT)
