"""Steps of a camera's clock that are too small for this computer's clock to show.

The marker on the gripper tells a camera's clock within a millisecond from a few seconds of a stir.
A clock that is the same in each stretch of it has not been stepped.
"""

from typing import NamedTuple

import numpy as np

from ..rig import View
from ..vision.clock import Clock, ClockError, fit_clock
from ..vision.measurement_series import FrameSeries
from .directory import VIEWS
from .raw import Raw, frame_series
from .stamps import JudgedStamps
from .stir import Span, stirred, view_clock, way_near

STRETCH = 4.0  # s of the camera's clock; shorter ones hold too few frames
MAX_STEP = 0.03  # s between two stretches: one frame; drifts take hours for it
MAX_STEP_ERRORS = 6.0  # standard errors by which a step must differ from none
MIN_UNEVENNESS = 0.25  # of a marker's motion that no uniform one explains: only that tells a time


class Unstepped(NamedTuple):
    """What was recorded before the first step of each camera's clock.

    Attributes:
        raw: Without the frames after it.
        clocks: Of the cameras that have no step, and were looked at.
    """

    raw: Raw
    clocks: dict[View, Clock]


def without_steps(raw: Raw, where: str) -> Unstepped:
    """What was recorded before the first step of each camera's clock.

    Args:
        raw: Of a session.
        where: Its directory, for a refusal.

    Raises:
        RigError: There is no stir, or a camera's clock cannot be found.
    """
    span = stirred(raw.samples, where)
    if span.last - span.first < 2.0 * STRETCH:
        return Unstepped(raw, {})
    frames, stamps, clocks = dict(raw.frames), dict(raw.stamps), {}
    for view in VIEWS:
        whole = view_clock(raw, view, span)
        if (step := _first_step(raw, view, span, whole)) is None:
            clocks[view] = whole
            continue
        at, size = step
        columns = raw.frames[view]
        before = columns["stamp"] < at
        frames[view] = {name: values[before] for name, values in columns.items()}
        stamps[view] = _judged(raw, view, before, size)
    return Unstepped(raw._replace(frames=frames, stamps=stamps), clocks)


def _judged(raw: Raw, view: View, before: np.ndarray, size: float) -> JudgedStamps:
    """The stamps before a step are good."""
    columns, was = raw.frames[view], raw.stamps[view]
    first = int(np.flatnonzero(~before)[0])
    after = columns["host"][first] - columns["host"][0]
    fault = (
        f"its stamps jump by {size:+.3f} s within {2 * STRETCH:g} s from frame "
        f"{int(columns['index'][first])} on ({after:.1f} s)"
    )
    good = was.good.copy()
    good[np.flatnonzero(good)[~before]] = False
    return JudgedStamps(good, fault)


def _first_step(raw: Raw, view: View, span: Span, whole: Clock) -> tuple[float, float] | None:
    """Stamp from which a step may have happened [s], and its size [s]; None without a step."""
    series = frame_series(raw.frames[view])
    edges = whole.to_camera(np.array([span.first, span.last]))
    starts = np.arange(edges[0], edges[1], STRETCH)
    clocks = [(start, _clock_in(raw, view, _part(series, start), whole)) for start in starts]
    known = [(start, clock) for start, clock in clocks if clock is not None]
    for (start, one), (_, other) in zip(known, known[1:], strict=False):
        between = np.array(0.5 * (one.reference + other.reference))
        size = float(one.to_robot(between) - other.to_robot(between))
        error = float(np.hypot(one.offset_error, other.offset_error))
        if np.isfinite(error) and abs(size) > max(MAX_STEP, MAX_STEP_ERRORS * error):
            return float(start), size
    return None


def _part(series: FrameSeries, start: float) -> FrameSeries:
    kept = (series.stamp >= start) & (series.stamp < start + STRETCH)
    lines = type(series.lines)(*(values[kept] for values in series.lines))
    return FrameSeries(series.stamp[kept], series.marker[kept], lines, series.flags[kept])


def unevenness(stamp: np.ndarray, marker: np.ndarray) -> float:
    """Share of a motion that a uniform one does not explain; 0 where there is none.

    Args:
        stamp: Times [s], shape (F,).
        marker: Places [px], shape (F, 2); NaN where the marker is hidden.
    """
    seen = np.isfinite(marker).all(axis=1)
    if seen.sum() < 3:
        return 0.0
    time = np.stack([np.ones(seen.sum()), stamp[seen] - stamp[seen].mean()], axis=1)
    left = marker[seen] - time @ np.linalg.lstsq(time, marker[seen], rcond=None)[0]
    spread = float(marker[seen].std(axis=0).max())
    return float(left.std(axis=0).max()) / spread if spread > 0.0 else 0.0


def _clock_in(raw: Raw, view: View, part: FrameSeries, whole: Clock) -> Clock | None:
    """The clock of a stretch; None where the gripper rests or keeps its velocity, or the marker is
    hidden."""
    if unevenness(part.stamp, part.marker) < MIN_UNEVENNESS:
        return None
    middle = float(part.stamp.mean())
    guess = float(whole.to_robot(np.array(middle))) - middle
    path = way_near(raw.samples, Span(middle + guess - STRETCH, middle + guess + STRETCH))
    marker = raw.provenance.rig.camera(view).marker
    try:
        return fit_clock(part, path, raw.provenance.cameras[view], marker, guess=guess)
    except (ClockError, np.linalg.LinAlgError):
        return None
