"""Kinematics of the UR10: where the tool is, which joints put it there, and whole paths.

Standard Denavit-Hartenberg convention: frame i follows frame i-1 by a turn `joint` about z, a
shift `d` along z, a shift `a` along x and a turn `alpha` about x. Tables: Universal Robots, "DH
parameters for calculations of kinematics and dynamics". A real arm's calibrated table differs
from them by up to some millimetres.
"""

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from .poses import Numbers, matrix_pose, pose_matrix

LARGEST_STEP = 0.3  # rad; a joint that moves further between two poses of a path jumps
_TURNS = (1, 0, 0, 1, -1, 0)  # alpha, in right angles
_Vector = tuple[float, float, float]


class _Frame(NamedTuple):
    """Axes and origin of a frame, in the base frame."""

    x: _Vector
    y: _Vector
    z: _Vector
    origin: _Vector


_BASE = _Frame((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


class DhArm(NamedTuple):
    """A six-axis arm of the UR family: three parallel axes (2 to 4) and two at right angles.

    Attributes:
        d: Shifts along z [m], of which the second and third are zero.
        a: Shifts along x [m], of which only the second and third are not zero.
        joint_limit: Greatest turn of each joint either way [rad].
        joint_speed: Greatest speed of each joint [rad/s].
    """

    d: tuple[float, float, float, float, float, float]
    a: tuple[float, float, float, float, float, float]
    joint_limit: float
    joint_speed: tuple[float, float, float, float, float, float]


# 120 deg/s of the two large joints, 180 deg/s of the others
_SPEEDS = (2.0 / 3.0 * math.pi, 2.0 / 3.0 * math.pi, math.pi, math.pi, math.pi, math.pi)

UR10 = DhArm(
    d=(0.1273, 0.0, 0.0, 0.163941, 0.1157, 0.0922),
    a=(0.0, -0.612, -0.5723, 0.0, 0.0, 0.0),
    joint_limit=2.0 * math.pi,
    joint_speed=_SPEEDS,
)
UR10E = DhArm(
    d=(0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655),
    a=(0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0),
    joint_limit=2.0 * math.pi,
    joint_speed=_SPEEDS,
)
ARMS = {"cb3": UR10, "e-series": UR10E}


class JointPath(NamedTuple):
    """Joints along a path of poses.

    Attributes:
        joints: [rad], shape [T, 6]; NaN from the first pose that cannot be reached.
        status: "ok"; "unreachable"; "jump": a joint moves further than allowed from one pose to
            the next, so that the arm would swing to another configuration; or "too fast": a
            joint exceeds its speed limit.
        at: Index of the first pose of which that is true; None if all is well.
        largest_step: Greatest change of a joint from one pose to the next [rad].
        fastest: Greatest speed of a joint as a share of its limit.
    """

    joints: np.ndarray
    status: Literal["ok", "unreachable", "jump", "too fast"]
    at: int | None
    largest_step: float
    fastest: float


def forward(arm: DhArm, joints: Numbers, *, tcp: Numbers | None = None) -> np.ndarray:
    """Pose of the TCP in the base frame, shape [6].

    Args:
        arm: The Denavit-Hartenberg table.
        joints: Joint angles [rad], shape [6].
        tcp: Pose of the TCP in the flange's frame; the flange itself if None.
    """
    flange = np.eye(4)
    flange[:3] = np.array(_frames(arm, joints)[-1]).T
    return matrix_pose(flange if tcp is None else flange @ pose_matrix(tcp))


def _frames(arm: DhArm, joints: Numbers) -> list[_Frame]:
    """The base and the six frames behind the joints.

    In plain floats, since an emulated arm asks for them every tick: 6 us, and 50 us as a product of
    six matrices.
    """
    frames = [_BASE]
    for joint, shift, reach, turn in zip(joints, arm.d, arm.a, _TURNS, strict=True):
        (xx, xy, xz), (yx, yy, yz), z, (px, py, pz) = frames[-1]
        cos, sin = math.cos(joint), math.sin(joint)
        x = (cos * xx + sin * yx, cos * xy + sin * yy, cos * xz + sin * yz)
        y = (cos * yx - sin * xx, cos * yy - sin * xy, cos * yz - sin * xz)
        origin = (
            px + shift * z[0] + reach * x[0],
            py + shift * z[1] + reach * x[1],
            pz + shift * z[2] + reach * x[2],
        )
        if turn == 1:
            y, z = z, (-y[0], -y[1], -y[2])
        elif turn == -1:
            y, z = (-z[0], -z[1], -z[2]), y
        frames.append(_Frame(x, y, z, origin))
    return frames


def jacobian(arm: DhArm, joints: Numbers, *, tcp: Numbers | None = None) -> np.ndarray:
    """Velocity of the TCP [m/s] and angular velocity [rad/s], base frame, per joint speed.

    Args:
        arm: The Denavit-Hartenberg table.
        joints: Joint angles [rad], shape [6].
        tcp: As for `forward`.

    Returns:
        Shape [6, 6]: rows vx, vy, vz, wx, wy, wz; columns the joints.
    """
    *frames, flange = _frames(arm, joints)
    ex, ey, ez = flange.origin
    if tcp is not None:
        ex, ey, ez = (np.array(flange).T @ (tcp[0], tcp[1], tcp[2], 1.0)).tolist()
    columns = []
    for _, _, (zx, zy, zz), (px, py, pz) in frames:
        rx, ry, rz = ex - px, ey - py, ez - pz
        columns.append((zy * rz - zz * ry, zz * rx - zx * rz, zx * ry - zy * rx, zx, zy, zz))
    return np.array(columns).T


def inverse(
    arm: DhArm, pose: Numbers, near: Numbers, *, tcp: Numbers | None = None
) -> np.ndarray | None:
    """Joints that put the TCP at a pose: of the up to eight solutions the one nearest to `near`.

    Closed form for the UR family (as in Hawkins, "Analytic inverse kinematics for the universal
    robots", 2013), exact to rounding also near singular configurations. Each joint is taken on
    the turn that is nearest to `near` within the arm's limits. Where the wrist's axes 4 and 6
    coincide, so that only their sum is determined, joint 6 is kept.

    Args:
        arm: The Denavit-Hartenberg table.
        pose: TCP in the base frame: position [m], rotation vector [rad].
        near: Joints [rad] from which the arm comes, shape [6].
        tcp: As for `forward`.

    Returns:
        Joints [rad], shape [6]; None if none within the joint limits reach the pose, or it is not
        finite.
    """
    target = pose_matrix(pose)
    if not np.isfinite(target).all():
        return None
    if tcp is not None:
        target = target @ _inverse_transform(pose_matrix(tcp))
    start = [float(value) for value in near]
    solutions = _solutions(arm, target, start[5])
    turned = [_nearest_turn(solution, start, arm.joint_limit) for solution in solutions]
    nearest = min(
        turned,
        key=lambda joints: sum((x - y) ** 2 for x, y in zip(joints, start, strict=True)),
        default=None,
    )
    return None if nearest is None else np.array(nearest)


def _inverse_transform(matrix: np.ndarray) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = matrix[:3, :3].T
    result[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return result


def _nearest_turn(joints: Sequence[float], near: Sequence[float], limit: float) -> list[float]:
    turned = []
    for joint, start in zip(joints, near, strict=True):
        joint += 2.0 * math.pi * round((start - joint) / (2.0 * math.pi))
        # the joint limits span two turns, so one of these is always inside
        if joint > limit:
            joint -= 2.0 * math.pi
        elif joint < -limit:
            joint += 2.0 * math.pi
        turned.append(joint)
    return turned


def _solutions(arm: DhArm, flange: np.ndarray, kept: float) -> list[tuple[float, ...]]:
    """All joints for a flange; joint 6 is `kept` where the wrist is singular."""
    (xx, yx, zx, px), (xy, yy, zy, py), (xz, yz, zz, pz) = flange[:3].tolist()
    # centre of the wrist; its distance from the plane of the three parallel axes is d4
    cx, cy, cz = px - arm.d[5] * zx, py - arm.d[5] * zy, pz - arm.d[5] * zz
    reach = math.hypot(cx, cy)
    if reach < abs(arm.d[3]):
        return []
    bearing, offset = math.atan2(cy, cx), math.asin(arm.d[3] / reach)
    found = []
    for one in (bearing + offset, bearing + math.pi - offset):
        c1, s1 = math.cos(one), math.sin(one)
        nx, ny, nz = s1 * xx - c1 * xy, s1 * yx - c1 * yy, s1 * zx - c1 * zy
        tilt = math.hypot(nx, ny)
        singular = tilt < 1e-9
        for sign in (1.0,) if singular else (1.0, -1.0):
            five = math.atan2(sign * tilt, nz)
            six = kept if singular else math.atan2(-sign * ny, sign * nx)
            c5, s5, c6, s6 = math.cos(five), math.sin(five), math.cos(six), math.sin(six)
            # axes of frame 4 and its origin, in the plane of the parallel axes
            x4x = c5 * (c6 * xx - s6 * yx) - s5 * zx
            x4y = c5 * (c6 * xy - s6 * yy) - s5 * zy
            x4z = c5 * (c6 * xz - s6 * yz) - s5 * zz
            turned = math.atan2(x4z, c1 * x4x + s1 * x4y)
            along = c1 * (cx + arm.d[4] * (s6 * xx + c6 * yx))
            along += s1 * (cy + arm.d[4] * (s6 * xy + c6 * yy))
            up = cz + arm.d[4] * (s6 * xz + c6 * yz) - arm.d[0]
            for two, three in _elbow(arm.a[1], arm.a[2], along, up):
                found.append((one, two, three, turned - two - three, five, six))
    return found


def _elbow(upper: float, fore: float, x: float, y: float) -> list[tuple[float, float]]:
    """Both pairs of angles with which two links reach (x, y); none if it is too far or near."""
    cosine = (x * x + y * y - upper**2 - fore**2) / (2.0 * upper * fore)
    if abs(cosine) > 1.0 + 1e-12:
        return []
    bend = math.acos(max(-1.0, min(1.0, cosine)))
    pairs = []
    for three in (bend, -bend):
        inner = math.atan2(fore * math.sin(three), upper + fore * math.cos(three))
        pairs.append((math.atan2(y, x) - inner, three))
    return pairs


def follow(
    arm: DhArm, poses: np.ndarray, start: Numbers, *, times: np.ndarray, tcp: Numbers | None = None
) -> JointPath:
    """Joints along a whole path, each nearest to the one before, and whether the arm can go it.

    Call it before any motion: a path of which every pose can be reached may still ask for a jump
    between configurations or, near a singular one, for joints faster than they are.

    Args:
        arm: The Denavit-Hartenberg table.
        poses: TCP in the base frame, shape [T, 6].
        start: Joints from which the path begins [rad], shape [6]; its first step counts too.
        times: Of the poses [s], shape [T], increasing.
        tcp: As for `forward`.

    Raises:
        ValueError: The times are not one for each pose, or do not increase.
    """
    if np.shape(times) != poses.shape[:1] or not (np.diff(times) > 0.0).all():
        raise ValueError(f"{np.size(times)} times of {len(poses)} poses: give increasing ones")
    joints = np.full(poses.shape, np.nan)
    near, reached = np.asarray(start, dtype=float), len(poses)
    for k, pose in enumerate(poses):
        found = inverse(arm, pose, near, tcp=tcp)
        if found is None:
            reached = k
            break
        joints[k] = near = found
    done = joints[:reached]
    steps = np.abs(np.diff(np.vstack([np.asarray(start, dtype=float), done]), axis=0)).max(axis=1)
    speeds = np.abs(np.diff(done, axis=0)) / np.diff(times)[: max(reached - 1, 0), None]
    share = (speeds / arm.joint_speed).max(axis=1)
    numbers = float(steps.max(initial=0.0)), float(share.max(initial=0.0))
    if reached < len(poses):
        return JointPath(joints, "unreachable", reached, *numbers)
    if (jumps := steps > LARGEST_STEP).any():
        return JointPath(joints, "jump", int(np.argmax(jumps)), *numbers)
    if (hurries := share > 1.0).any():
        return JointPath(joints, "too fast", int(np.argmax(hurries)) + 1, *numbers)
    return JointPath(joints, "ok", None, *numbers)
