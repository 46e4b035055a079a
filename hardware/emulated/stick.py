"""A stick that hangs as a table says, wherever along its path the arm is.

The arm lags its plan, waits, and may be stopped. So not the clock tells where in the table it is,
but the nearest point of the table's path, looked for a short way ahead and never behind: where
strokes cross each other, the other stroke is too far ahead to be found. Time counts as distance
at a low `PACE`, which lets the phase go on by the clock while the table rests or turns round.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..motion.poses import Numbers

AHEAD = 0.1  # s of the table, in which one tick of the arm is looked for
PACE = 0.02  # m/s; strokes are faster than that nearly everywhere
NEAR = 0.01  # m from the path; further away the stick is out of the liquid, or elsewhere
FADE = 0.5  # s, in which a stick that has left the path comes to hang straight down
RECOVERY = 0.05  # s of going on, in which what was waited for is undone to 1/e
AT_REST = 4e-4  # m from the end of the path, in which its last rest has begun
HEADING = 0.3  # s of the way that tells a direction


class StickMotion(NamedTuple):
    """A stir as a table, in the cup's frame.

    Attributes:
        time: From its start [s], shape (T,), increasing.
        pivot: Position of the stick's upper end [m], shape (T, 3).
        inclination: From the downward vertical in the frame's xz and yz planes [rad], shape (T, 2),
            positive with the tip towards +x and +y.
    """

    time: np.ndarray
    pivot: np.ndarray
    inclination: np.ndarray


def checked(motion: StickMotion) -> StickMotion:
    """The motion as it is.

    Raises:
        ValueError: Shapes do not agree, a number is not finite, or times do not rise.
    """
    for fault in _faults(motion):
        raise ValueError(f"a stick's motion has {fault}")
    return motion


def _faults(motion: StickMotion) -> Iterator[str]:
    shapes, size = tuple(np.shape(part) for part in motion), np.size(motion.time)
    if size < 2 or shapes != ((size,), (size, 3), (size, 2)):
        yield f"shapes {shapes}; give (T,), (T, 3) and (T, 2) of at least two rows"
    for name, values in motion._asdict().items():
        if not np.isfinite(values).all():
            yield f"a {name} that is not finite; give numbers only"
    if not (np.diff(motion.time) > 0.0).all():
        yield "times that do not rise; sort its rows"


class Replay(NamedTuple):
    """A stick, and where in its table it is.

    Attributes:
        motion: The table.
        phase: Time of the table [s].
        still: How long the arm has waited there [s].
        near: 1 on the path, 0 where the stick hangs straight down, and between them on the way.
        rest: Time of the table at which its last rest begins [s].
    """

    motion: StickMotion
    phase: float
    still: float
    near: float
    rest: float


def init(motion: StickMotion) -> Replay:
    """A stick that hangs straight down, before a stir."""
    away = np.linalg.norm(motion.pivot - motion.pivot[-1], axis=1) > AT_REST
    begins = int(np.flatnonzero(away)[-1]) + 1 if away.any() else 0
    return Replay(motion, float(motion.time[0]), 0.0, 0.0, float(motion.time[begins]))


def advance(state: Replay, pivot: Numbers, dt: float) -> Replay:
    """One tick later.

    A stick that has come to hang straight down starts anew.

    Args:
        state: Before the tick.
        pivot: Where the arm is at its end, in the table's frame [m], shape (3,).
        dt: Of the tick [s].
    """
    motion = state.motion
    phase, distance = _nearest(motion, state.phase, pivot, dt)
    if distance > NEAR:
        if (near := state.near - dt / FADE) > 0.0:
            return state._replace(near=near)
        return state._replace(phase=float(motion.time[0]), still=0.0, near=0.0)
    # slower than half the table's pace, the arm waits, or comes to a stop; a rest is no stop
    waits = phase - state.phase < 0.5 * dt and _heading(motion, phase) != 0.0
    still = state.still + dt if waits else state.still * math.exp(-dt / RECOVERY)
    return state._replace(phase=phase, still=still, near=min(state.near + dt / FADE, 1.0))


def angles(state: Replay) -> tuple[float, float]:
    """Inclination in the xz and yz planes of the table's frame [rad].

    While the arm waits, the stick relaxes as in the table's last rest, turned to where the arm came
    from: strokes of a star are alike but for their direction. What it leans otherwise fades.
    """
    motion, lean = state.motion, _lean(state.motion, state.phase)
    if state.still > 0.0:
        turn = _heading(motion, state.phase) * _heading(motion, state.rest).conjugate()
        first, then = _lean(motion, state.rest), _lean(motion, state.rest + state.still)
        lean = turn * then + (lean - turn * first) * math.exp(-state.still / FADE)
    lean *= state.near
    return float(lean.real), float(lean.imag)


def _lean(motion: StickMotion, time: float) -> complex:
    """Inclination at a time of the table, in xz as the real and in yz as the imaginary part."""
    x, y = _between(motion.time, motion.inclination, time)
    return complex(x, y)


def _heading(motion: StickMotion, time: float) -> complex:
    """Direction of the way before a time of the table, of length 1; 0 where it rests."""
    x, y, _ = _between(motion.time, motion.pivot, time)
    before_x, before_y, _ = _between(motion.time, motion.pivot, time - HEADING)
    way = complex(x - before_x, y - before_y)
    return way / abs(way) if abs(way) > AT_REST else 0j


# in plain floats: these few numbers, every tick, cost NumPy's functions three times as much


def _between(times: np.ndarray, rows: np.ndarray, time: float) -> list[float]:
    """A row between two; a table may be so long that looking at all of it takes a tick."""
    after = min(max(int(times.searchsorted(time)), 1), len(times) - 1)
    before, then = times[after - 1 : after + 1].tolist()
    first, last = rows[after - 1 : after + 1].tolist()
    share = min(max((time - before) / (then - before), 0.0), 1.0)
    return [a + share * (b - a) for a, b in zip(first, last, strict=True)]


def _nearest(motion: StickMotion, phase: float, pivot: Numbers, dt: float) -> tuple[float, float]:
    """Phase of the nearest point from `phase` on, and the pivot's distance from it [m]."""
    first = int(motion.time.searchsorted(phase, side="right"))
    last = int(motion.time.searchsorted(phase + AHEAD, side="right"))
    places = zip(motion.pivot[first:last].tolist(), motion.time[first:last].tolist(), strict=True)
    here = (*_between(motion.time, motion.pivot, phase), PACE * phase)
    points = [here, *((*place, PACE * time) for place, time in places)]
    target = (*map(float, pivot), PACE * (phase + dt))
    feet = [_foot(target, start, end) for start, end in pairwise(points)]
    best = min(feet, key=lambda foot: math.dist(foot, target), default=here)
    return max(best[3] / PACE, phase), math.dist(best[:3], target[:3])


def _foot(point: Sequence[float], start: Sequence[float], end: Sequence[float]) -> list[float]:
    """The point of the segment from `start` to `end` that is nearest to `point`."""
    way = [b - a for a, b in zip(start, end, strict=True)]
    along = sum((p - a) * w for p, a, w in zip(point, start, way, strict=True))
    length = sum(w * w for w in way)
    share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    return [a + share * w for a, w in zip(start, way, strict=True)]
