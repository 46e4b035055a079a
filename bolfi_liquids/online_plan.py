"""The planned stir, and the data so far as samples along it."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError
from .recording_fields import DENSITIES
from .recordings import Gripper, Recording
from .strokes import strokes

FARTHEST = 2e-3  # m that the arm may be off its plan; star strokes are 50 mm long
LATEST = 0.2  # s that the arm may be late, or early; a servoed arm follows by some 0.1 s
SEARCHED = 0.4  # s, up to which its delay is looked for
GAP = 2.5  # sampling intervals of the plan; data farther apart are not interpolated between
MOVED = 5e-3  # m from which the delay shows
SLACK = 1e-3  # s by which a stroke may seem to lack its end, as the delay is only estimated


class SoFar(NamedTuple):
    """A recording while it is made; times are the robot clock's since the plan began.

    Attributes:
        time: Of the samples [s], shape (S,), increasing.
        position: Of the gripper [m], shape (S, 3), NaN where missing.
        inclination: Of the stick in the xz and yz planes [rad], shape (S, 2), NaN where missing.
        ended: When the last of them was taken, by `time.monotonic` [s].
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    inclination: NDArray[np.float64]
    ended: float


class Followed(NamedTuple):
    """Data along the plan.

    Attributes:
        observed: Inclination at the plan's times [rad], shape (T, 2), NaN after the last finished
            stroke and where nothing was seen.
        strokes: Finished.
        covered: When the last of them was to end [s]; -inf where there is none.
        delay: Of the arm behind its plan [s]; what was observed is shifted by it.
        apart: Greatest distance of the arm from the plan, the delay allowed for [m].
        refusal: Why these data are no stir along the plan; "" if they are.
    """

    observed: NDArray[np.float64]
    strokes: int
    covered: float
    delay: float
    apart: float
    refusal: str


def planned(time: ArrayLike, position: ArrayLike, attrs: Mapping[str, float | str]) -> Recording:
    """A stir that was not made yet, as a recording that has seen nothing.

    Args:
        time: Of the path [s], shape (T,), increasing. What is simulated is sampled at these
            times, so let them be about as far apart as the cameras' frames.
        position: Of the gripper [m], shape (T, 3).
        attrs: As a recording's: geometry and densities.

    Raises:
        InputError: The density of the liquid is missing, or the path is no path.
    """
    time, position = np.array(time, np.float64), np.array(position, np.float64)
    rises = time.ndim == 1 and len(time) > 2 and bool((np.diff(time) > 0).all())
    if not rises or position.shape != (len(time), 3) or not np.isfinite(position).all():
        raise InputError(
            f"times of shape {time.shape} and positions of shape {position.shape}",
            where="planned path",
            fix="give (T,) increasing times in s and (T, 3) finite positions in m",
        )
    for name in DENSITIES:
        if name not in attrs:
            raise InputError("missing", where=f"plan: attribute {name}", fix="weigh the liquid")
    unseen = np.full((len(time), 2), np.nan)
    path = Gripper(time, position)
    return Recording(time, path, unseen, MappingProxyType(dict(attrs)), Path("plan"), "")


def stroke_ends(plan: Recording) -> NDArray[np.float64]:
    """When each stroke of a plan ends [s], shape (strokes,), the rest after it included."""
    found = [stroke for stroke in strokes(plan) if stroke.number > 0]
    ends = [float(plan.time[stroke.samples][-1]) for stroke in found]
    position = plan.gripper.position[found[-1].samples]
    still = np.linalg.norm(position - position[-1], axis=1).max() < MOVED
    # the rest after the last stroke is none
    return np.array(ends[:-1] if still and len(ends) > 1 else ends)


def follow(plan: Recording, ends: NDArray, so_far: SoFar) -> Followed:
    """Bring data onto the plan's times, cut after the last finished stroke.

    Args:
        plan: Of `planned`.
        ends: Of `stroke_ends`.
        so_far: Of which at least two positions were seen.

    Raises:
        InputError: The arrays are no recording.
    """
    _check(so_far)
    delay = _delay(plan, so_far)
    time = so_far.time - delay
    apart = float(np.nanmax(_distance(plan, so_far, delay)))
    done = int(np.searchsorted(ends, time[-1] + SLACK, side="right"))
    covered = float(ends[done - 1]) if done else float("-inf")
    observed = np.column_stack([_sampled(plan.time, time, y) for y in so_far.inclination.T])
    observed[plan.time > covered + SLACK] = np.nan
    return Followed(observed, done, covered, delay, apart, _refusal(delay, apart))


def _check(so_far: SoFar) -> None:
    size = len(so_far.time)
    shapes = (so_far.time.shape, so_far.position.shape, so_far.inclination.shape)
    if size < 2 or shapes != ((size,), (size, 3), (size, 2)):
        raise InputError(
            f"arrays of shapes {shapes}",
            where="data so far",
            fix="give (S,) times, (S, 3) positions and (S, 2) inclinations of at least two samples",
        )
    if not (np.diff(so_far.time) > 0).all():
        raise InputError("times do not rise", where="data so far", fix="sort the samples")
    if np.isfinite(so_far.position).all(axis=1).sum() < 2:
        raise InputError("fewer than two positions", where="data so far", fix="wait for the arm")


def _distance(plan: Recording, so_far: SoFar, delay: float) -> NDArray[np.float64]:
    """Of the arm from where it was to be `delay` before [m], shape (S,), NaN where missing."""
    time = so_far.time - delay
    wanted = np.column_stack([np.interp(time, plan.time, axis) for axis in plan.gripper.position.T])
    return np.linalg.norm(so_far.position - wanted, axis=1)


def _delay(plan: Recording, so_far: SoFar) -> float:
    """The one with which the arm is nearest to its plan [s]; 0 before it has moved."""
    from scipy.optimize import minimize_scalar

    seen = so_far.position[np.isfinite(so_far.position).all(axis=1)]
    if np.linalg.norm(seen - seen[0], axis=1).max() < MOVED:
        return 0.0

    def squared(delay: float) -> float:
        return float(np.nanmean(_distance(plan, so_far, delay) ** 2))

    found = minimize_scalar(squared, bounds=(-SEARCHED, SEARCHED), method="bounded")
    # as recorded, where that is as near as can be
    return 0.0 if squared(0.0) <= squared(float(found.x)) else float(found.x)


def _sampled(wanted: NDArray, time: NDArray, values: NDArray) -> NDArray[np.float64]:
    """Linear between neighbours that are near enough, NaN elsewhere."""
    seen = np.isfinite(values)
    if seen.sum() < 2:
        return np.full(len(wanted), np.nan)
    known = time[seen]
    after = np.clip(np.searchsorted(known, wanted), 1, len(known) - 1)
    near = known[after] - known[after - 1] <= GAP * np.median(np.diff(wanted))
    inside = (wanted >= known[0]) & (wanted <= known[-1])
    return np.where(near & inside, np.interp(wanted, known, values[seen]), np.nan)


def _refusal(delay: float, apart: float) -> str:
    if abs(delay) > LATEST:
        side = "behind" if delay > 0 else "ahead of"
        return (
            f"the arm is {1e3 * abs(delay):.0f} ms {side} its plan, more than "
            f"{1e3 * LATEST:.0f} ms: what is simulated is not what it does"
        )
    if apart > FARTHEST:
        return (
            f"the arm is {1e3 * apart:.1f} mm off its plan, more than {1e3 * FARTHEST:.0f} mm: "
            "what is simulated is not what it does"
        )
    return ""
