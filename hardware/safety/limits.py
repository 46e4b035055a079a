"""Limits of a motion before it may begin, and of each of its set-points on the way.

A path that breaks a limit is refused as a whole; nothing is clipped.
"""

from collections.abc import Generator, Iterator
from typing import NamedTuple

import numpy as np

from ..arm import Tool
from ..errors import MotionRejected
from ..motion.kinematics import ARMS, DhArm, follow, inverse
from ..motion.poses import cup_frame
from ..motion.stir_paths import PosePath
from ..rig import AxisLimits, Limits, Rig

MAX_TILT = {
    "stirring": np.radians(15.0),
    "pouring": np.radians(150.0),
}  # from the rig's orientation
SPEED_ROUNDING = 1e-6  # relative, of speeds and accelerations
JOINT_AGREEMENT = 0.1  # rad, of the arm's own joints with ours; another configuration is further
MOST_SAMPLES = 150_000  # 20 minutes
SLICE_SAMPLES = 20  # samples, whose check lasts some thousandths of a second

Refusals = Iterator[tuple[str, str]]  # what is wrong, and where


class Workspace(NamedTuple):
    """Range of one tool, and the arm that carries it.

    Attributes:
        box: Range of the tool's centre, in the cup's frame.
        tcp: The tool's centre in the flange's frame.
        orientation: Rotation vector of the tool before it does anything, in the base frame [rad].
        tilt: Greatest angle from it [rad].
        arm: Its kinematics.
        start: Joints near which it works [rad].
    """

    box: AxisLimits
    tcp: np.ndarray
    orientation: np.ndarray
    tilt: float
    arm: DhArm
    start: np.ndarray


def workspace(rig: Rig, tool: Tool) -> Workspace:
    """Workspace of one of a rig's two tools."""
    robot = rig.robot
    return Workspace(
        box=getattr(rig.limits, tool),
        tcp=np.array(getattr(robot, f"{tool}_tcp")),
        orientation=np.array(getattr(robot, f"{tool}_orientation")),
        tilt=MAX_TILT[tool],
        arm=ARMS[robot.controller],
        start=np.array(robot.start),
    )


def check_path(
    path: PosePath, rig: Rig, tool: Tool, *, joints: np.ndarray | None = None
) -> np.ndarray:
    """Refuse a path that is not safe as a whole: S4 of the safety requirements.

    All poses must be finite, on the motion loop's clock, at rest at both ends, slow enough in
    speed, acceleration and tilt, inside the box by the way that the arm needs to stop, and
    reachable by joints that neither jump nor exceed their own speeds.

    Args:
        path: What shall be followed.
        rig: Its limits, its cup and its arm.
        tool: Which of the two tools' box and centre count.
        joints: Of the arm at the start of the path [rad]; where it is not known, the solution
            nearest to the rig's `start` is taken.

    Returns:
        The joints at its end [rad], shape (6,).

    Raises:
        MotionRejected: naming time, field, value and limit.
    """
    checks = path_checks(path, rig, tool, joints=joints)
    while True:
        try:
            next(checks)
        except StopIteration as end:
            return end.value


def path_checks(
    path: PosePath, rig: Rig, tool: Tool, *, joints: np.ndarray | None = None
) -> Generator[None, None, np.ndarray]:
    """`check_path` slice by slice, for who has something else to do in between."""
    _refuse(_numbers(path, rig.robot.rate))
    space = workspace(rig, tool)
    now = np.empty(6)
    for start in range(0, len(path.time), SLICE_SAMPLES):
        part = _part(path, start)
        _refuse(_rates(part, rig.limits))
        _refuse(_turns(part, space, rig.limits))
        _refuse(_places(part, space.box, rig.limits))
        if tool == "stirring":
            _refuse(_tip(part, rig))
        if start == 0:
            now = _first_joints(cup_frame(rig.cup).to_base(path.pose[0]), space, joints)
        now = _reached(part, space, rig, now)
        yield
    return now


class _Part(NamedTuple):
    """A slice of a path with the two samples before it, which its rates need.

    Attributes:
        time: Of the samples [s].
        pose: Likewise.
        new: The first sample that is not in the slice before.
        velocity: Between them, and at rest before a path's first and after its last [m/s].
        between: Times of the velocities [s].
    """

    time: np.ndarray
    pose: np.ndarray
    new: int
    velocity: np.ndarray
    between: np.ndarray


def _part(path: PosePath, start: int) -> _Part:
    first, end = max(start - 2, 0), start + SLICE_SAMPLES
    time, pose = path.time[first:end], path.pose[first:end]
    dt = float(path.time[1])
    velocity = np.diff(pose[:, :3], axis=0) / dt
    between = time[1:]
    still = np.zeros((1, 3))
    if start == 0:
        velocity, between = np.concatenate([still, velocity]), time
    if end >= len(path.time):
        velocity = np.concatenate([velocity, still])
        between = np.append(between, time[-1] + dt)
    return _Part(time, pose, start - first, velocity, between)


def margin(speed: np.ndarray | float, limits: Limits) -> np.ndarray | float:
    """Way [m] that the arm still goes after a stop is ordered at `speed` [m/s]."""
    return speed**2 / (2.0 * limits.acceleration) + speed * limits.latency


class TargetCheck:
    """The check of each set-point, for a driver: cheap, and the last one before the wire."""

    def __init__(self, rig: Rig, tool: Tool):
        self._frame = cup_frame(rig.cup)
        self._box = workspace(rig, tool).box
        self._step = rig.limits.speed / rig.robot.rate
        self._turn = np.radians(rig.limits.tilt_rate_deg_s) / rig.robot.rate

    def __call__(self, previous: np.ndarray, target: np.ndarray) -> None:
        """Refuse a set-point that is not finite, outside the box or too far from the last.

        Args:
            previous: The last one, or where the tool is; in the base frame, shape (6,).
            target: The next, one period later.

        Raises:
            MotionRejected: naming field, value and limit.
        """
        _refuse(self._refusals(previous, target))

    def _refusals(self, previous: np.ndarray, target: np.ndarray) -> Refusals:
        if target.shape != (6,) or not np.isfinite(target).all():
            yield f"the pose {target.tolist()} is not six finite numbers", "set-point"
        if not np.isfinite(previous).all():
            yield f"the pose before it, {previous.tolist()}, is not finite", "set-point"
        position, low, high = self._frame.from_base(target)[:3], self._box.low, self._box.high
        for k in np.flatnonzero((position < low - 1e-9) | (position > high + 1e-9)):
            what = f"{'xyz'[k]} = {position[k]:.4f} m is outside [{low[k]}, {high[k]}] m"
            yield what, "set-point"
        step = float(np.linalg.norm(target[:3] - previous[:3]))
        turn = turn_between(previous[3:], target[3:])
        for name, value, most, unit in (
            ("step", step, self._step, "m"),
            ("turn", turn, self._turn, "rad"),
        ):
            if value > most * (1.0 + SPEED_ROUNDING) + 1e-9:
                yield f"a {name} of {value:.5f} {unit} is above {most:.5f} {unit}", "set-point"


def turn_between(first: np.ndarray, second: np.ndarray) -> float:
    """Angle between two orientations [rad], given as rotation vectors."""
    from scipy.spatial.transform import Rotation

    if np.array_equal(first, second):
        return 0.0
    turns = Rotation.from_rotvec(np.stack([first, second]))
    return float((turns[0].inv() * turns[1]).magnitude())


def _refuse(refusals: Refusals) -> None:
    for what, where in refusals:
        raise _refused(what, where)


def _refused(what: str, where: str) -> MotionRejected:
    return MotionRejected(what, where=where, fix="correct the plan or the rig's limits")


def _numbers(path: PosePath, rate: float) -> Refusals:
    time, pose = path.time, path.pose
    matching = pose.ndim == 2 and pose.shape[1] == 6 and time.shape == pose.shape[:1]
    if not matching or len(time) < 2:
        yield f"times of shape {time.shape} and poses of shape {pose.shape}", "path"
    if len(time) > MOST_SAMPLES:
        yield f"{len(time)} samples are more than {MOST_SAMPLES}", "path"
    for k in np.flatnonzero(~(np.isfinite(pose).all(axis=1) & np.isfinite(time))):
        what = f"the pose {pose[k].tolist()} at {time[k]} s is not finite"
        yield what, f"path at sample {k}"
    if np.abs(time - np.arange(len(time)) / rate).max() > 1e-6:
        yield f"its times are not those of a {rate:g} Hz clock from 0 s", "path"


def _rates(part: _Part, limits: Limits) -> Refusals:
    speed = np.linalg.norm(part.velocity, axis=1)
    yield from _above(part.between, speed, limits.speed * (1.0 + SPEED_ROUNDING), "speed", "m/s")
    if len(part.velocity) > 1:
        dt = float(part.between[1] - part.between[0])
        change = np.linalg.norm(np.diff(part.velocity, axis=0), axis=1) / dt
        most = limits.acceleration * (1.0 + SPEED_ROUNDING)
        yield from _above(part.between[:-1], change, most, "acceleration", "m/s2")


def _turns(part: _Part, space: Workspace, limits: Limits) -> Refusals:
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_rotvec(part.pose[:, 3:])
    tilt = (Rotation.from_rotvec(space.orientation).inv() * turns).magnitude()
    yield from _above(part.time, np.degrees(tilt), float(np.degrees(space.tilt)), "tilt", "deg")
    if len(part.time) > 1:
        rate = (turns[:-1].inv() * turns[1:]).magnitude() / np.diff(part.time)
        most = limits.tilt_rate_deg_s * (1.0 + SPEED_ROUNDING)
        yield from _above(part.time[1:], np.degrees(rate), most, "tilt rate", "deg/s")


def _places(part: _Part, box: AxisLimits, limits: Limits) -> Refusals:
    dt = float(part.time[1] - part.time[0]) if len(part.time) > 1 else 1.0
    speed = np.linalg.norm(np.diff(part.pose[:, :3], axis=0), axis=1) / dt
    fastest = np.maximum(np.append(speed, 0.0), np.insert(speed, 0, 0.0))
    kept = np.asarray(margin(fastest, limits))
    for axis, name in enumerate("xyz"):
        value, low, high = part.pose[:, axis], box.low[axis] + kept, box.high[axis] - kept
        for k in np.flatnonzero((value < low - 1e-9) | (value > high + 1e-9)):
            what = f"{name} = {value[k]:.4f} m is outside [{low[k]:.4f}, {high[k]:.4f}] m"
            yield f"{what} (the box less {1e3 * kept[k]:.1f} mm to stop)", _when(part.time[k])


def _tip(part: _Part, rig: Rig) -> Refusals:
    """The hanging stick must not meet the cup's wall; rig.toml keeps it off the floor."""
    x, y, z = part.pose[:, :3].T
    inside = z - rig.stick.length < rig.cup.height
    away = np.where(inside, np.hypot(x, y) + rig.stick.radius, 0.0)
    k = int(away.argmax())
    if away[k] >= rig.cup.radius:
        what = f"the stick is {away[k]:.4f} m from the cup's axis while its tip is in the cup"
        yield f"{what} (cup.radius = {rig.cup.radius} m)", _when(part.time[k])


def _first_joints(pose: np.ndarray, space: Workspace, joints: np.ndarray | None) -> np.ndarray:
    """Joints of a path's first pose: those that the arm has, where that is known."""
    near, start = space.start if joints is None else np.asarray(joints), _when(0.0)
    if not np.isfinite(near).all():
        raise _refused(f"the arm's joints {near.tolist()} are not finite", start)
    first = inverse(space.arm, pose, near, tcp=space.tcp)
    if first is None:
        raise MotionRejected("no joints reach its first pose", where=start, fix="correct the plan")
    away = float(np.abs(first - near).max())
    if joints is not None and not away <= JOINT_AGREEMENT:
        raise _refused(f"its first pose is {away:.2f} rad of a joint from the arm", start)
    return first


def _reached(part: _Part, space: Workspace, rig: Rig, joints: np.ndarray) -> np.ndarray:
    """Joints at the part's end, from those at the last sample before its new ones."""
    begin = max(part.new - 1, 0)
    poses, times = cup_frame(rig.cup).to_base(part.pose[begin:]), part.time[begin:]
    found = follow(space.arm, poses, joints, times=times, tcp=space.tcp)
    if found.status != "ok":
        what = (
            f"joints: {found.status} (largest step {found.largest_step:.3f} rad, fastest "
            f"{found.fastest:.2f} of a joint's limit)"
        )
        raise _refused(what, _when(times[found.at or 0]))
    return found.joints[-1]


def _above(time: np.ndarray, value: np.ndarray, most: float, name: str, unit: str) -> Refusals:
    k = int(value.argmax())
    if not value[k] <= most:
        yield f"{name} {value[k]:.4f} {unit} is above {most:.4f} {unit}", _when(time[k])


def _when(time: float) -> str:
    return f"path at {time:.3f} s"
