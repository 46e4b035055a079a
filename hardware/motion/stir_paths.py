"""Motions of the arm while it stirs: timed poses that a rig's file determines, rest to rest."""

from typing import NamedTuple

import numpy as np

from ..rig import MAX_CYCLES, Rig
from .patterns import circle, star_vertices, travelled

TURN_RATE = np.radians(30.0)  # rad/s, of the tool between two orientations
TURN_ACCELERATION = np.radians(90.0)  # rad/s2
CIRCLE_TURNS = 4.0  # of one cycle


class PosePath(NamedTuple):
    """A timed path of the tool's centre, which starts and ends at rest.

    Attributes:
        time: From 0 at the rate of the motion loop [s], shape (T,).
        pose: Position [m] in the cup's frame, rotation vector [rad] in the base frame,
            shape (T, 6).
        stirring: Whether what happens is a stir; otherwise it is the way there or back.
    """

    time: np.ndarray
    pose: np.ndarray
    stirring: bool

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.time[-1])


class Profile(NamedTuple):
    """A way of `length` from rest to rest: trapezoidal speed, in the way's own unit."""

    length: float
    peak: float
    ramp: float

    @property
    def duration(self) -> float:
        """Duration of the whole way [s]."""
        return self.length / self.peak + self.ramp if self.length > 0.0 else 0.0

    def travelled(self, elapsed: np.ndarray) -> np.ndarray:
        """Length covered after `elapsed` [s], which may lie before the start or past the end."""
        if self.length == 0.0:
            return np.zeros_like(elapsed)
        within = np.clip(elapsed, 0.0, self.duration)
        return travelled(within, self.duration, self.ramp, self.peak)


def profile(length: float, speed: float, acceleration: float) -> Profile:
    """The fastest trapezoid within a greatest speed and acceleration; a triangle if it is short."""
    peak = min(speed, float(np.sqrt(length * acceleration)))
    return Profile(length, peak, peak / acceleration)


def approach(rig: Rig, pose: np.ndarray) -> PosePath:
    """Path of the tool to above the cup's axis: straight up, then sideways, then down.

    Args:
        rig: What is known of the place.
        pose: Where the tool is now, position in the cup's frame, shape (6,).
    """
    return up_and_over(rig, pose, above_cup(rig), rig.stirring.approach_speed)


def up_and_over(rig: Rig, pose: np.ndarray, target: np.ndarray, speed: float) -> PosePath:
    """Path from one pose to another: straight up, then sideways, then down."""
    high = max(pose[2], target[2])
    corners = [pose, placed(pose, z=high), placed(target, z=high), target]
    return travel(rig, corners, speed)


def above_cup(rig: Rig) -> np.ndarray:
    """The pose on the cup's axis from which a stir begins, the stick out of the cup, shape (6,)."""
    return np.array([0.0, 0.0, rig.stirring.clear_height, *rig.robot.stirring_orientation])


def insert(rig: Rig) -> PosePath:
    """Straight down along the cup's axis, until the stick is in the liquid."""
    return travel(
        rig,
        [above_cup(rig), placed(above_cup(rig), z=rig.stirring.height)],
        rig.stirring.approach_speed,
    )


def retract(rig: Rig, place: np.ndarray | None = None) -> PosePath:
    """To the cup's axis and straight up.

    Args:
        rig: What is known of the place.
        place: Where the stir ended, in the cup's frame [m], shape (3,); None for its plan's end.
    """
    x, y, _ = strokes(rig)[-1].pose[-1, :3] if place is None else place
    low = placed(above_cup(rig), z=rig.stirring.height)
    corners = [placed(low, x=x, y=y), low, above_cup(rig)]
    return travel(rig, corners, rig.stirring.approach_speed)


def stir(rig: Rig, cycles: int | None = None) -> PosePath:
    """All of a stir; see `strokes`, which this joins.

    Args:
        rig: The plan of the stir.
        cycles: How often the pattern is repeated; as in the rig's file if None.
    """
    return joined(strokes(rig, cycles))


def strokes(rig: Rig, cycles: int | None = None) -> list[PosePath]:
    """A stir stroke by stroke, each from rest to rest and starting where the last one ended.

    The star is that of `patterns.star`, but for its strokes, which last whole periods of the
    motion loop. The first one holds the rest above the cup's axis and the way to the first vertex,
    the last ends with a rest, and the others with a pause. A star ends at its first vertex and is
    repeated from there. Each stroke of a circle is a whole `patterns.circle`.

    Raises:
        ValueError: `cycles` is below 1 or above `MAX_CYCLES`.
    """
    count = rig.stirring.cycles if cycles is None else cycles
    if not 1 <= count <= MAX_CYCLES:
        raise ValueError(f"cycles: {count} is not from 1 to {MAX_CYCLES}")
    plan = rig.stirring
    low = placed(above_cup(rig), z=plan.height)
    if plan.pattern == "circle":
        lines = [_circle(rig)] * count
    else:
        once = [placed(low, x=x, y=y) for x, y in star_vertices(plan.points, plan.radius)]
        corners = [low, once[0], *once[1:] * count]
        lines = [
            travel(rig, [start, end], plan.speed).pose
            for start, end in zip(corners, corners[1:], strict=False)
        ]
    rest, pause = (round(seconds * rig.robot.rate) for seconds in (plan.rest, plan.pause))
    waits = [pause] * (len(lines) - 1) + [rest]
    lines = [
        np.concatenate([line, np.tile(line[-1], (wait, 1))])
        for line, wait in zip(lines, waits, strict=True)
    ]
    lines[0] = np.concatenate([np.tile(low, (rest, 1)), lines[0]])
    return [_timed(rig, line, stirring=True) for line in lines]


def travel(rig: Rig, corners: list[np.ndarray], speed: float) -> PosePath:
    """Straight lines through poses, at rest at each, the tool turning evenly on the way.

    Args:
        rig: Gives rate and acceleration.
        corners: Poses, position in the cup's frame; equal neighbours are passed over.
        speed: Greatest [m/s].
    """
    dt = 1.0 / rig.robot.rate
    parts = [np.asarray(corners[0], dtype=float)[None]]
    for start, end in zip(corners, corners[1:], strict=False):
        line = _line(start, end, speed, rig, dt)
        parts.append(line[1:])
    pose = np.concatenate(parts)
    if len(pose) == 1:
        pose = np.repeat(pose, 2, axis=0)
    return _timed(rig, pose)


def joined(paths: list[PosePath]) -> PosePath:
    """Paths that continue each other as one; it counts as stirring if the first does."""
    dt = float(paths[0].time[1] - paths[0].time[0])
    pose = np.concatenate([paths[0].pose, *[path.pose[1:] for path in paths[1:]]])
    return PosePath(dt * np.arange(len(pose)), pose, paths[0].stirring)


def turn_rate(rig: Rig, most: float) -> float:
    """A rate of turning [rad/s] that the rig's limits allow, at most `most`."""
    return min(most, float(np.radians(rig.limits.tilt_rate_deg_s)))


def _line(start: np.ndarray, end: np.ndarray, speed: float, rig: Rig, dt: float) -> np.ndarray:
    from scipy.spatial.transform import Rotation, Slerp

    turns = Rotation.from_rotvec(np.stack([start[3:], end[3:]]))
    turn = float((turns[0].inv() * turns[1]).magnitude())
    shift = float(np.linalg.norm(end[:3] - start[:3]))
    ways = (
        profile(shift, speed, rig.stirring.acceleration),
        profile(turn, turn_rate(rig, TURN_RATE), TURN_ACCELERATION),
    )
    slower = max(ways, key=lambda way: way.duration)
    if slower.duration == 0.0:
        return start[None]
    # the last sample comes a part of a period late, at rest
    elapsed = dt * np.arange(int(np.ceil(slower.duration / dt - 1e-9)) + 1)
    share = np.clip(slower.travelled(elapsed) / slower.length, 0.0, 1.0)
    share[-1] = 1.0
    position = start[:3] + share[:, None] * (end[:3] - start[:3])
    if turn < 1e-9:
        return np.column_stack([position, np.tile(start[3:], (len(share), 1))])
    return np.column_stack([position, Slerp([0.0, 1.0], turns)(share).as_rotvec()])


def _circle(rig: Rig) -> np.ndarray:
    """Poses of one cycle, at rest for a period of the motion loop before and after."""
    plan = rig.stirring
    path = circle(
        speed=plan.speed,
        height=plan.height,
        radius=plan.radius,
        turns=CIRCLE_TURNS,
        rest=1.0 / rig.robot.rate,
        rate=rig.robot.rate,
    )
    turn = np.tile(rig.robot.stirring_orientation, (len(path.time), 1))
    return np.column_stack([path.position, turn])


def _timed(rig: Rig, pose: np.ndarray, *, stirring: bool = False) -> PosePath:
    return PosePath(np.arange(len(pose)) / rig.robot.rate, pose, stirring)


def placed(
    pose: np.ndarray, *, x: float | None = None, y: float | None = None, z: float | None = None
) -> np.ndarray:
    """The pose with some of its coordinates [m] replaced, shape (6,)."""
    moved = np.array(pose, dtype=float)
    for axis, value in enumerate((x, y, z)):
        if value is not None:
            moved[axis] = value
    return moved
