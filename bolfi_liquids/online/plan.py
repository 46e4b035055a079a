"""The planned stir, and the data so far as samples along it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inputs.recording import Recording
from ..inputs.strokes import strokes

MAX_OFF_PLAN = 2e-3  # m that the arm may be off its plan; star strokes are 50 mm long
MAX_DELAY_CHANGE = 0.2  # s by which a stroke may change the delay; a servoed arm lags some 0.1 s
SEARCHED, STEP = 0.4, 0.02  # s, up to which such a change is looked for, and how finely at first
MAX_GAP = 2.5  # sampling intervals of the plan; data farther apart are not interpolated between
MOVED_DISTANCE = 5e-3  # m from which the delay shows
END_SLACK = 1e-3  # s by which a stroke may seem to lack its end, as the delay is only estimated


class PartialRecording(NamedTuple):
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


class Aligned(NamedTuple):
    """Data along the plan.

    Attributes:
        observed: Inclination at the plan's times [rad], shape (T, 2), NaN after the last finished
            stroke and where nothing was seen.
        strokes: Finished.
        covered: When the last of them was to end [s]; -inf where there is none.
        delay: Of the arm behind its plan in the last finished stroke, or else in the first [s].
        apart: Greatest distance of the arm from the plan, each stroke's delay allowed for [m].
        refusal: Why these data are no stir along the plan; "" if they are.
    """

    observed: NDArray[np.float64]
    strokes: int
    covered: float
    delay: float
    apart: float
    refusal: str


def stroke_ends(plan: Recording) -> NDArray[np.float64]:
    """When each stroke of a plan ends [s], shape (strokes,), the rest after it included."""
    found = [stroke for stroke in strokes(plan) if stroke.number > 0]
    ends = [float(plan.time[stroke.samples][-1]) for stroke in found]
    position = plan.gripper.position[found[-1].samples]
    still = np.linalg.norm(position - position[-1], axis=1).max() < MOVED_DISTANCE
    # the rest after the last stroke is none
    return np.array(ends[:-1] if still and len(ends) > 1 else ends)


def align(plan: Recording, ends: NDArray, so_far: PartialRecording) -> Aligned:
    """Bring data onto the plan's times, cut after the last finished stroke.

    Each stroke is shifted by a delay of its own: a control loop that misses periods delays all
    that is still to come.

    Args:
        plan: Of `planned`.
        ends: Of `stroke_ends`.
        so_far: The data.
    """
    if fault := _fault(so_far):
        nothing = np.full((len(plan.time), 2), np.nan)
        return Aligned(nothing, 0, float("-inf"), 0.0, 0.0, fault)
    delays, apart = _delays(plan, ends, so_far)
    done = len(delays) - 1
    covered = float(ends[done - 1]) if done else float("-inf")
    stroke = np.minimum(np.searchsorted(ends, plan.time - END_SLACK), done)
    wanted = plan.time + delays[stroke]
    observed = np.column_stack([_sampled(wanted, so_far.time, y) for y in so_far.inclination.T])
    observed[plan.time > covered + END_SLACK] = np.nan
    delay = float(delays[max(done - 1, 0)])
    change = np.diff(delays, prepend=0.0)
    refusal = _refusal(float(change[np.abs(change).argmax()]), apart)
    return Aligned(observed, done, covered, delay, apart, refusal)


def _fault(so_far: PartialRecording) -> str:
    """Why these data are no recording; "" if they are."""
    shapes = tuple(map(np.shape, so_far[:3]))
    count = np.size(so_far.time)
    if shapes != ((count,), (count, 3), (count, 2)):
        return f"time, position and inclination have shapes {shapes}, not (S,), (S, 3), (S, 2)"
    if not (np.isfinite(so_far.time).all() and (np.diff(so_far.time) > 0.0).all()):
        return "its times do not increase"
    if np.isfinite(so_far.position).all(axis=1).sum() < 2:
        return "fewer than two of the arm's positions are known"
    return ""


def _delays(
    plan: Recording, ends: NDArray, so_far: PartialRecording
) -> tuple[NDArray[np.float64], float]:
    """Delay of each stroke, finished or not [s], and the arm's greatest distance.

    Returns:
        Delays, shape (finished + 1,), and the distance from the plan that they leave [m].
    """
    seen = np.isfinite(so_far.position).all(axis=1)
    time, position = so_far.time[seen], so_far.position[seen]
    delays, apart, delay, until = [], 0.0, 0.0, -np.inf
    for end in (*ends, np.inf):
        since, until = until, end + delay
        within = (time > since) & (time <= until)
        # what has hardly moved yet shows neither a delay nor another path
        if within.any() and np.ptp(position[within], axis=0).max() > MOVED_DISTANCE:
            delay = _delay(plan, time[within], position[within], delay)
            distance = _distance(plan, time[within] - delay, position[within])
            apart = max(apart, float(distance.max()))
        delays.append(delay)
        if so_far.time[-1] + END_SLACK < end + delay:
            break
    return np.array(delays), apart


def _distance(plan: Recording, time: NDArray, position: NDArray) -> NDArray[np.float64]:
    """Distance of the arm from its plan [m], shape (S,)."""
    wanted = np.column_stack([np.interp(time, plan.time, axis) for axis in plan.gripper.position.T])
    return np.linalg.norm(position - wanted, axis=1)


def _delay(plan: Recording, time: NDArray, position: NDArray, before: float) -> float:
    """The one with which the arm is nearest to its plan [s]."""
    from scipy.optimize import minimize_scalar

    def squared_error(delay: float) -> float:
        return float(np.mean(_distance(plan, time - delay, position) ** 2))

    # of a stroke that has just begun, there may be several minima
    tried = before + np.arange(-SEARCHED, SEARCHED + STEP, STEP)
    near = float(tried[np.argmin([squared_error(delay) for delay in tried])])
    found: Any = minimize_scalar(squared_error, bounds=(near - STEP, near + STEP), method="bounded")
    # as recorded, where that is as near as can be
    return before if squared_error(before) <= squared_error(found.x) else float(found.x)


def _sampled(wanted: NDArray, time: NDArray, values: NDArray) -> NDArray[np.float64]:
    """Linear between neighbours that are near enough, NaN elsewhere."""
    seen = np.isfinite(values)
    if seen.sum() < 2:
        return np.full(len(wanted), np.nan)
    known = time[seen]
    after = np.clip(np.searchsorted(known, wanted), 1, len(known) - 1)
    near = known[after] - known[after - 1] <= MAX_GAP * np.median(np.diff(wanted))
    inside = (wanted >= known[0]) & (wanted <= known[-1])
    return np.where(near & inside, np.interp(wanted, known, values[seen]), np.nan)


def _refusal(change: float, apart: float) -> str:
    if abs(change) > MAX_DELAY_CHANGE:
        what = "lost" if change > 0 else "gained"
        return (
            f"the arm {what} {1e3 * abs(change):.0f} ms on its plan in one stroke, more than "
            f"{1e3 * MAX_DELAY_CHANGE:.0f} ms: the simulated motion differs from the arm's"
        )
    if apart > MAX_OFF_PLAN:
        return (
            f"the arm is {1e3 * apart:.1f} mm off its plan, more than {1e3 * MAX_OFF_PLAN:.0f} mm: "
            "the simulated motion differs from the arm's"
        )
    return ""
