import numpy as np
import pytest
from bolfi_liquids.hardware.errors import MotionRejected
from bolfi_liquids.hardware.motion.kinematics import UR10, forward, inverse
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.pour_paths import pour_path
from bolfi_liquids.hardware.motion.stir_paths import (
    PosePath,
    approach,
    insert,
    retract,
    stir,
    travel,
)
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.safety import limits
from bolfi_liquids.hardware.safety.limits import (
    TargetCheck,
    check_path,
    margin,
    turn_between,
    workspace,
)
from scipy.spatial.transform import Rotation

RIG = bundled_rig()


def with_limits(**changes):
    return RIG.model_copy(update={"limits": RIG.limits.model_copy(update=changes)})


def slid(path, axis, to):
    """The path, moved so that its largest value along an axis is `to`."""
    pose = path.pose.copy()
    pose[:, axis] += to - pose[:, axis].max()
    return path._replace(pose=pose)


def put(path, sample, column, value):
    pose = path.pose.copy()
    pose[sample, column] = value
    return path._replace(pose=pose)


def straight(speed):
    ends = [np.array([x, 0.0, 0.25, *RIG.robot.stirring_orientation]) for x in (-0.03, 0.03)]
    return travel(RIG, ends, speed)


def leaning(path, angle):
    lean = Rotation.from_rotvec([0.0, angle, 0.0]) * Rotation.from_rotvec(path.pose[:, 3:])
    return path._replace(pose=np.column_stack([path.pose[:, :3], lean.as_rotvec()]))


@pytest.mark.parametrize("controller", ["cb3", "e-series"])
def test_the_bundled_plan_keeps_its_limits_on_both_generations(controller):
    robot = RIG.robot.model_copy(update={"controller": controller})
    rig = RIG.model_copy(update={"robot": robot})
    joints = None
    for path in (
        approach(rig, np.array([0.02, 0.02, 0.3, np.pi, 0, 0])),
        insert(rig),
        stir(rig, 2),
        retract(rig),
    ):
        joints = check_path(path, rig, "stirring", joints=joints)
        space = workspace(rig, "stirring")
        reached = forward(space.arm, joints, tcp=space.tcp)
        assert reached[:3] == pytest.approx(cup_frame(rig.cup).to_base(path.pose[-1])[:3])


@pytest.mark.parametrize(("distance", "rate_deg_s"), [(0.0, 30.0), (0.07, 180.0)])
def test_the_bundled_pours_keep_their_limits(distance, rate_deg_s):
    path = pour_path(
        RIG,
        angular_velocity=np.radians(rate_deg_s),
        distance=distance,
        lip_height=0.2,
        final_angle=np.radians(135.0),
        hold=0.5,
    )
    check_path(path, RIG, "pouring")


STIR = stir(RIG)
BROKEN = {
    "NaN": (put(STIR, 700, 1, np.nan), "sample 700.*not finite"),
    "infinite turn": (put(STIR, 3, 5, np.inf), "sample 3.*not finite"),
    "time": (STIR._replace(time=STIR.time * 1.001), "not those of a 125 Hz clock"),
    "NaN time": (STIR._replace(time=np.where(STIR.time > 3, np.nan, STIR.time)), "finite"),
    "shape": (STIR._replace(pose=STIR.pose[:, :5]), "shape"),
    "too short": (PosePath(STIR.time[:1], STIR.pose[:1], True), "shape"),
    "box x": (slid(STIR, 0, 0.08), "x = .* is outside"),
    "box y": (slid(STIR, 1, 0.08), "y = .* is outside"),
    "box z": (slid(STIR, 2, 0.37), "z = .* is outside"),
    "tip": (slid(STIR, 0, 0.0362), "cup's axis"),
    "speed": (straight(0.16), r"speed 0\.15[0-9]* m/s is above 0\.15"),
    "acceleration": (put(STIR, 700, 0, STIR.pose[700, 0] + 2e-4), "acceleration .* is above"),
    "jump": (put(STIR, 700, 0, STIR.pose[700, 0] + 0.01), r"path at 5\.6.* speed .* is above"),
    "starts in motion": (PosePath(STIR.time[:300], STIR.pose[400:700], True), "acceleration"),
    "ends in motion": (PosePath(STIR.time[:640], STIR.pose[:640], True), "acceleration"),
    "tilt": (leaning(STIR, 0.4), "tilt 22.* deg is above 15"),
    "tilt rate": (
        STIR._replace(pose=np.where(STIR.time[:, None] < 4, STIR.pose, leaning(STIR, 0.1).pose)),
        "tilt rate .* is above",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_path_that_breaks_a_limit_is_refused_as_a_whole(name):
    path, words = BROKEN[name]
    before = path.pose.copy()
    with pytest.raises(MotionRejected, match=words):
        check_path(path, RIG, "stirring")
    # refused, not clipped
    assert np.array_equal(path.pose, before, equal_nan=True)


def test_a_path_may_come_up_to_a_limit_and_not_beyond():
    straight_up = insert(RIG)  # planned at 0.05 m/s and 0.5 m/s2
    check_path(straight_up, with_limits(speed=0.05, acceleration=0.5), "stirring")
    for name, value in (("speed", 0.0495), ("acceleration", 0.495)):
        with pytest.raises(MotionRejected, match=name):
            check_path(straight_up, with_limits(**{name: value}), "stirring")


def test_the_box_s_margin_is_the_way_to_stop():
    assert margin(0.1, RIG.limits) == pytest.approx(0.1**2 / (2 * 0.6) + 0.1 * 0.05)
    # a stroke at full speed ends 13 mm before the side; a slow one may come to it
    fast = slid(STIR, 0, 0.0475)
    reach = np.abs(STIR.pose[:, :2]).max()
    assert reach < 0.03
    check_path(slid(STIR, 0, 0.03), RIG, "stirring")
    with pytest.raises(MotionRejected, match="mm to stop"):
        check_path(fast, with_limits(latency=0.3), "stirring")


def test_a_place_out_of_reach_is_refused():
    cup = RIG.cup.model_copy(update={"position": (1.0, -1.0, 0.05)})
    with pytest.raises(MotionRejected, match="no joints reach"):
        check_path(STIR, RIG.model_copy(update={"cup": cup}), "stirring")


def reached(distance, height):
    """Whether any joints put the stick there; a singular wrist is as good as another."""
    space = workspace(RIG, "stirring")
    pose = np.array([0.0, -distance, height, *RIG.robot.stirring_orientation])
    return inverse(space.arm, pose, space.start, tcp=space.tcp) is not None


def test_a_path_that_leaves_the_reach_is_refused_before_it_begins():
    height = RIG.cup.position[2] + RIG.stirring.height
    farthest = max(d for d in np.arange(1.0, 1.4, 0.001) if reached(d, height))
    cup = RIG.cup.model_copy(update={"position": (0.0, -farthest, RIG.cup.position[2])})
    with pytest.raises(MotionRejected, match=r"path at [3-9]\.\d+ s: joints: unreachable"):
        check_path(STIR, RIG.model_copy(update={"cup": cup}), "stirring")


def test_a_path_that_asks_too_much_of_a_joint_is_refused(monkeypatch):
    monkeypatch.setitem(limits.ARMS, "cb3", UR10._replace(joint_speed=(0.05,) * 6))
    with pytest.raises(MotionRejected, match="joints: too fast"):
        check_path(STIR, RIG, "stirring")


def test_an_arm_in_another_configuration_is_refused():
    space = workspace(RIG, "stirring")
    base = cup_frame(RIG.cup).to_base(STIR.pose[0])
    other = inverse(space.arm, base, [-0.95, -1.7, -1.7, -1.3, 1.6, -2.5], tcp=space.tcp)
    check_path(STIR, RIG, "stirring", joints=other)
    with pytest.raises(MotionRejected, match="rad of a joint from the arm"):
        check_path(STIR, RIG, "stirring", joints=other + 0.2)
    with pytest.raises(MotionRejected, match="joints .*nan.* are not finite"):
        check_path(STIR, RIG, "stirring", joints=np.full(6, np.nan))


BASE = cup_frame(RIG.cup).to_base(STIR.pose[0])
AWAY = 0.15 / 125.0
TARGETS = {
    "NaN": ([np.nan, 0, 0, 0, 0, 0], "not six finite"),
    "step": ([1.01 * AWAY, 0, 0, 0, 0, 0], "a step of .* m is above .* m;"),
    "turn": ([0, 0, 0, np.radians(181.0) / 125.0, 0, 0], "a turn of .* rad is above .* rad;"),
    "box": ([0.051, 0, 0, 0, 0, 0], "x = .* is outside"),
    "below": ([0, 0, -0.03, 0, 0, 0], "z = .* is outside"),
}


@pytest.mark.parametrize("name", TARGETS)
def test_a_set_point_that_breaks_a_limit_is_refused(name):
    change, words = TARGETS[name]
    with pytest.raises(MotionRejected, match=words):
        TargetCheck(RIG, "stirring")(BASE, BASE + change)


def test_set_points_within_their_limits_pass():
    check = TargetCheck(RIG, "stirring")
    base = cup_frame(RIG.cup).to_base(STIR.pose[:800])
    for previous, target in zip(base, base[1:], strict=False):
        check(previous, target)
    with pytest.raises(MotionRejected, match="not six finite"):
        check(BASE, BASE[:3])
    check(BASE, BASE + [0.99 * AWAY, 0, 0, 0, 0, 0])


@pytest.mark.parametrize("axis", [0, 3])
def test_nothing_is_within_a_step_of_a_pose_that_is_not_known(axis):
    where = BASE.copy()
    where[axis] = np.nan
    with pytest.raises(MotionRejected, match="before it, .*nan.* is not finite"):
        TargetCheck(RIG, "stirring")(where, BASE)


def test_orientations_are_compared_as_turns_not_as_numbers():
    # both are half a turn about x
    assert turn_between(np.array([np.pi, 0, 0]), np.array([-np.pi, 0, 0])) < 1e-9


def test_the_cup_s_frame_turns_with_the_cup():
    yaw_deg = -120.0
    cup = RIG.cup.model_copy(update={"yaw_deg": yaw_deg})
    frame = cup_frame(cup)
    pose = np.array([0.01, 0.02, 0.3, 0.1, 0.2, 0.3])
    turned = Rotation.from_euler("z", yaw_deg, degrees=True).apply(pose[:3])
    assert frame.to_base(pose)[:3] == pytest.approx(turned + cup.position)
    assert frame.from_base(frame.to_base(pose)) == pytest.approx(pose)
