import numpy as np
import pytest
from bolfi_liquids.hardware.motion import kinematics
from bolfi_liquids.hardware.motion import poses as geometry
from bolfi_liquids.hardware.motion.kinematics import UR10, UR10E
from scipy.spatial.transform import Rotation

TCP = np.array([0.01, -0.02, 0.18, 0.2, -0.1, 0.3])


def random_joints(seed, count):
    return np.random.default_rng(seed).uniform(-2 * np.pi, 2 * np.pi, (count, 6))


def elementary_product(arm, joints):
    """The definition of the convention, one elementary transform after the other."""
    alpha = np.array([90, 0, 0, 90, -90, 0])
    result = np.eye(4)
    for i in range(6):
        about_z, about_x, shift = np.eye(4), np.eye(4), np.eye(4)
        about_z[:3, :3] = Rotation.from_euler("z", joints[i]).as_matrix()
        about_x[:3, :3] = Rotation.from_euler("x", alpha[i], degrees=True).as_matrix()
        shift[:3, 3] = arm.a[i], 0.0, arm.d[i]
        result = result @ about_z @ shift @ about_x
    return result


def test_rotations_are_those_of_scipy():
    rng = np.random.default_rng(1)
    lengths = np.concatenate([np.linspace(0.0, np.pi - 1e-6, 40), [1e-12, 1e-6, np.pi - 1e-12]])
    for length in lengths:
        axis = rng.normal(size=3)
        vector = length * axis / np.linalg.norm(axis)
        matrix = Rotation.from_rotvec(vector).as_matrix()
        assert geometry.rotation_matrix(vector) == pytest.approx(matrix, abs=1e-14)
        assert geometry.rotation_vector(matrix) == pytest.approx(vector, abs=1e-11)


def test_a_half_turn_comes_back_as_itself_or_its_opposite():
    for axis in np.eye(3):
        vector = geometry.rotation_vector(Rotation.from_rotvec(np.pi * axis).as_matrix())
        assert np.abs(vector) == pytest.approx(np.pi * axis, abs=1e-12)


def test_stretched_ur10_is_where_its_data_sheet_puts_it():
    # all joints at zero, the arm lies along -x: a2 + a3, -(d4 + d6), d1 - d5
    pose = kinematics.forward(UR10, np.zeros(6))
    assert pose == pytest.approx([-1.1843, -0.256141, 0.0116, np.pi / 2, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("arm", [UR10, UR10E], ids=["ur10", "ur10e"])
def test_forward_is_the_product_of_elementary_transforms(arm):
    for joints in random_joints(2, 20):
        expected = elementary_product(arm, joints)
        found = geometry.pose_matrix(kinematics.forward(arm, joints))
        assert found == pytest.approx(expected, abs=1e-13)
        with_tool = expected @ geometry.pose_matrix(TCP)
        found = geometry.pose_matrix(kinematics.forward(arm, joints, tcp=TCP))
        assert found == pytest.approx(with_tool, abs=1e-13)


@pytest.mark.parametrize("arm", [UR10, UR10E], ids=["ur10", "ur10e"])
def test_inverse_undoes_forward(arm):
    for joints in random_joints(3, 300):
        pose = kinematics.forward(arm, joints, tcp=TCP)
        found = kinematics.inverse(arm, pose, joints, tcp=TCP)
        reached = geometry.pose_matrix(kinematics.forward(arm, found, tcp=TCP))
        assert reached == pytest.approx(geometry.pose_matrix(pose), abs=1e-9)
        assert found == pytest.approx(joints, abs=1e-8)


def test_inverse_takes_the_configuration_that_is_near():
    joints = np.array([0.3, -1.2, 1.5, -1.9, -1.4, 0.2])
    pose = kinematics.forward(UR10, joints)
    assert kinematics.inverse(UR10, pose, joints + 0.1) == pytest.approx(joints, abs=1e-9)
    turned = joints.copy()
    turned[5] -= 2 * np.pi
    assert kinematics.inverse(UR10, pose, turned) == pytest.approx(turned, abs=1e-9)
    other = kinematics.inverse(UR10, pose, [0.3, -0.2, -1.5, 1.5, -1.4, 0.2])
    assert other[2] < 0.0
    assert kinematics.forward(UR10, other) == pytest.approx(pose, abs=1e-9)


def test_inverse_stays_within_the_joint_limits():
    near = np.array([6.2, -1.2, 1.5, -1.9, -1.4, 6.2])
    beyond = near + [0.2, 0, 0, 0, 0, 0.2]
    pose = kinematics.forward(UR10, beyond)
    found = kinematics.inverse(UR10, pose, near)
    assert np.abs(found).max() <= UR10.joint_limit
    assert kinematics.forward(UR10, found) == pytest.approx(pose, abs=1e-9)


def test_poses_out_of_reach_have_no_joints():
    for pose in ([2.0, 0, 0, 0, 0, 0], [0.0, 0.0, 0.5, 0, 0, 0], [np.nan, 0, 0.5, 0, 0, 0]):
        assert kinematics.inverse(UR10, pose, np.zeros(6)) is None


def test_a_singular_wrist_keeps_its_last_joint_and_the_pose():
    joints = np.array([0.3, -1.2, 1.5, -1.9, 0.0, 0.7])
    pose = kinematics.forward(UR10, joints)
    found = kinematics.inverse(UR10, pose, joints + [0.01, 0, 0, 0, 0, -0.2])
    assert found[5] == pytest.approx(0.5)
    assert kinematics.forward(UR10, found) == pytest.approx(pose, abs=1e-9)


def test_jacobian_is_the_derivative_of_forward():
    step = 1e-6
    for joints in random_joints(4, 20):
        found = kinematics.jacobian(UR10, joints, tcp=TCP)
        for i, change in enumerate(step * np.eye(6)):
            before, after = (
                geometry.pose_matrix(kinematics.forward(UR10, moved, tcp=TCP))
                for moved in (joints - change, joints + change)
            )
            linear = (after - before)[:3, 3] / (2 * step)
            turn = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec() / (2 * step)
            assert found[:, i] == pytest.approx([*linear, *turn], abs=1e-8)


START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])


def straight(length, count=50):
    poses = np.tile(kinematics.forward(UR10, START, tcp=TCP), (count, 1))
    poses[:, 0] += np.linspace(0.0, length, count)
    return poses


def test_follow_goes_along_a_path_within_the_joint_speeds():
    poses = straight(0.1)
    result = kinematics.follow(UR10, poses, START, times=np.linspace(0, 1, 50), tcp=TCP)
    assert (result.status, result.at) == ("ok", None)
    assert result.largest_step < 0.01
    for pose, joints in zip(poses, result.joints, strict=True):
        assert kinematics.forward(UR10, joints, tcp=TCP)[:3] == pytest.approx(pose[:3], abs=1e-9)
    speeds = np.abs(np.diff(result.joints, axis=0)) * 49 / UR10.joint_speed
    assert result.fastest == pytest.approx(speeds.max())


def test_times_that_are_not_one_a_pose_and_increasing_are_refused():
    times = np.linspace(0, 1, 50)
    for wrong in (times[::-1], times[:-1], np.where(times > 0.5, np.nan, times)):
        with pytest.raises(ValueError, match="times of 50 poses"):
            kinematics.follow(UR10, straight(0.1), START, times=wrong, tcp=TCP)


def test_follow_says_where_a_path_leaves_the_arm_s_reach():
    result = kinematics.follow(UR10, straight(-2.0), START, times=np.arange(50.0), tcp=TCP)
    assert result.status == "unreachable"
    assert np.isfinite(result.joints[: result.at]).all()
    assert np.isnan(result.joints[result.at :]).all()


def test_follow_says_where_the_arm_would_be_too_fast_or_jump():
    poses = straight(0.1)
    times = np.concatenate([np.linspace(0, 1, 40), 1 + 1e-4 * np.arange(1, 11)])
    result = kinematics.follow(UR10, poses, START, times=times, tcp=TCP)
    assert (result.status, result.at) == ("too fast", 40)
    assert result.fastest > 1.0
    poses[30:, 0] += 0.5
    result = kinematics.follow(UR10, poses, START, times=np.arange(50.0), tcp=TCP)
    assert (result.status, result.at) == ("jump", 30)
