"""The stir in what a session has left: one table of gripper and stick on the robot's clock."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..csv_file import read_csv
from ..errors import RigError
from ..motion.poses import Trajectory
from ..rig import View
from ..safety.guards import MAX_CLOCK_DRIFT
from ..vision.delay import Delay, DelayError, fit_delay
from ..vision.frame import FrameMeasurement, first_fault
from ..vision.inclination import FrameSeries, MeasuredView, frame_series, join
from .directory import VIEWS, Provenance, frames_file, read_provenance
from .samples import SAMPLES, Sample

LEAST_SAMPLES = 50
LEAST_FRAMES = 30
Columns = dict[str, NDArray[np.float64]]
TABLE_RATE = 30.0  # of the table [1/s]; the cameras' in "To Stir or Not to Stir"
DELAY_MARGIN = 1.0  # [s] before and after the stir that the delays are learned from, too
LONGEST_GAP = 0.1  # [s] without a sample of the robot, over which nothing is interpolated
MOST_GAP = 0.2  # [s]; a recording ends at a longer one, since a simulator needs the way
LEAST_TIME = 1.0  # [s] of a stir


class Raw(NamedTuple):
    """All that was recorded, in the order of the clocks.

    Attributes:
        provenance: Of the session.
        samples: Columns of samples.csv, times rising.
        frames: Columns of each view's frames up to its first fault; stamps on the robot's clock,
            rising.
        lost_samples: Rows that the control process took and samples.csv lacks.
        faults: Why a view's later frames cannot be used; empty where nothing is wrong.
    """

    provenance: Provenance
    samples: Columns
    frames: dict[View, Columns]
    lost_samples: int
    faults: dict[View, str]


def read_raw(directory: Path) -> Raw:
    """Read what is there.

    Raises:
        RigError: The robot's samples or a view's frames are missing, or too few.
    """
    provenance = read_provenance(directory)
    rows = _read(directory / SAMPLES, Sample._fields)
    samples = _rising(rows, "time")
    begin = samples["host"][samples["stirring"] == 1].min(initial=np.inf)
    frames: dict[View, Columns] = {}
    faults: dict[View, str] = {}
    for view in VIEWS:
        seen = _read(directory / frames_file(view), FrameMeasurement._fields)
        end, faults[view] = first_fault(seen["index"], seen["stamp"], begin)
        frames[view] = {name: values[:end] for name, values in seen.items()}
    counts = {SAMPLES: len(samples["time"])}
    counts |= {frames_file(view): len(frames[view]["stamp"]) for view in VIEWS}
    _check_enough(directory, counts, [f"view {view}: {one}" for view, one in faults.items() if one])
    for of in frames.values():
        of["stamp"] = robot_time(of["stamp"], samples["host"], samples["time"])
    return Raw(provenance, samples, frames, lost_rows(rows["index"]), faults)


def robot_time(
    stamp: NDArray[np.float64], host: NDArray[np.float64], time: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Times of this computer's clock [s], on the robot's clock [s].

    The clocks differ by a constant and a drift: a line through the samples, robust to those that
    were read late, by the median slope of pairs half the samples apart.

    Args:
        stamp: To be converted.
        host: When each sample was read, shape (N,).
        time: Of each sample on the robot's clock, shape (N,).
    """
    half = len(time) // 2
    rates = (time[half:] - time[: len(time) - half]) / (host[half:] - host[: len(host) - half])
    rate = float(np.clip(np.median(rates), 1.0 - MAX_CLOCK_DRIFT, 1.0 + MAX_CLOCK_DRIFT))
    origin = host[half]
    return rate * (stamp - origin) + np.median(time - rate * (host - origin))


def lost_rows(index: NDArray[np.float64]) -> int:
    """Number of rows that are missing from a table: gaps of its rising index, shape (N,)."""
    return int(index[-1] - index[0] + 1 - len(index))


def missed(clock: NDArray[np.float64]) -> int:
    """Number of times that a source's clock leaves out: it sent, and nobody fetched.

    A camera's queue drops old pictures, and a controller's client keeps only the newest package:
    a computer that stands still for longer than their period misses some.

    Args:
        clock: Times of the rows [s], shape (N,), N at least 2, rising.
    """
    steps = np.diff(clock) / np.median(np.diff(clock))
    return int((np.rint(steps[steps > 1.5]) - 1).sum())


def _read(path: Path, fields: tuple[str, ...]) -> Columns:
    try:
        return read_csv(path, fields)
    except FileNotFoundError:
        return {name: np.empty(0) for name in fields}
    except ValueError as err:
        raise RigError(
            str(err), where=str(path), fix="was it recorded by another version?"
        ) from err


def _rising(columns: Columns, clock: str) -> Columns:
    """Without the rows whose clock stands still or goes back: a source that repeats itself."""
    time = columns[clock]
    before = np.maximum.accumulate(np.concatenate([[-np.inf], time[:-1]]))
    kept = np.isfinite(time) & (time > before)
    return {name: values[kept] for name, values in columns.items()}


def _check_enough(directory: Path, counts: dict[str, int], faults: list[str]) -> None:
    needed = {SAMPLES: LEAST_SAMPLES} | {frames_file(view): LEAST_FRAMES for view in VIEWS}
    short = [name for name, count in counts.items() if count < needed[name]]
    if short:
        there = ", ".join(f"{name} has {count} rows" for name, count in counts.items())
        there = "; ".join([there, *faults])
        raise RigError(
            f"{' and '.join(short)} hold too little: {there}",
            where=str(directory),
            fix=f"a recording needs {LEAST_SAMPLES} samples and {LEAST_FRAMES} frames of each "
            "view; record again",
        )


class Stir(NamedTuple):
    """A stir; T samples at `TABLE_RATE`.

    Attributes:
        time: From its first sample [s], shape (T,).
        position: Of the pivot in the cup's frame [m], shape (T, 3).
        inclination: In the xz and yz planes [rad], shape (T, 2); NaN where it was not seen.
        error: Standard errors of the inclination [rad], shape (T, 2).
        flags: Why there is no inclination, as `Flag`; shape (T,).
        origin: The robot's time at `time` 0 [s].
        delays: Of the cameras.
        cut: Why it ends before the last sample of the stir; empty where it does not.
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    inclination: NDArray[np.float64]
    error: NDArray[np.float64]
    flags: NDArray[np.int64]
    origin: float
    delays: dict[View, Delay]
    cut: str


class Span(NamedTuple):
    """Span of the robot's time [s], and why it ends before the stir does."""

    first: float
    last: float
    cut: str = ""


def extract_stir(raw: Raw, where: str, until: float = np.inf) -> Stir:
    """Cut out the stir, find the delays of the cameras, and join both views.

    Args:
        raw: Of a session.
        where: Its directory, for a refusal.
        until: Take nothing after this time of the robot's clock [s].

    Raises:
        RigError: There is no stir, it is too short, or a camera's delay cannot be found.
    """
    span = _stirred(raw.samples, where, until)
    _check_length(span, where)
    series = {view: frame_series(raw.frames[view]) for view in VIEWS}
    delays: dict[View, Delay] = {view: _delay(raw, view, span, series[view]) for view in VIEWS}
    for view in VIEWS:
        span = _seen(span, series[view], delays[view].delay, f"view {view}", raw.faults[view])
    _check_length(span, where)
    time = np.arange(np.floor((span.last - span.first) * TABLE_RATE + 1e-6) + 1) / TABLE_RATE
    times = span.first + time
    xz, yz = (MeasuredView(series[v], delays[v].delay, raw.provenance.cameras[v]) for v in VIEWS)
    joined = join(xz, yz, times)
    position = [np.interp(times, raw.samples["time"], raw.samples[axis]) for axis in "xyz"]
    unknown = _in_gap(raw.samples["time"], times)
    return Stir(
        time=time,
        position=np.where(unknown[:, None], np.nan, np.column_stack(position)),
        inclination=joined.angle,
        error=joined.error,
        flags=joined.flags,
        origin=span.first,
        delays=delays,
        cut=span.cut,
    )


def _in_gap(time: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of `times` lie in a gap of `time` that is longer than `LONGEST_GAP`."""
    after = np.clip(np.searchsorted(time, times), 1, len(time) - 1)
    return time[after] - time[after - 1] > LONGEST_GAP


def _stirred(samples: Columns, where: str, until: float) -> Span:
    """Span from the first to the last sample of the stir, or up to a gap between them."""
    time = samples["time"]
    stirring = np.flatnonzero((samples["stirring"] == 1) & (time <= until))
    if len(stirring) == 0:
        raise RigError(
            f"none of its {len(time)} samples belongs to a stir",
            where=where,
            fix="the session ended before it; record again",
        )
    first, last = int(stirring[0]), int(stirring[-1])
    gaps = np.flatnonzero(np.diff(time[first : last + 1]) > MOST_GAP)
    if len(gaps) == 0:
        return Span(float(time[first]), float(time[last]))
    before = first + int(gaps[0])
    lacking = time[before + 1] - time[before]
    return Span(
        float(time[first]), float(time[before]), f"no samples of the robot for {lacking:.2f} s"
    )


def _way_near(samples: Columns, span: Span) -> Trajectory:
    """The gripper's positions that the delays are learned from."""
    near = (samples["time"] > span.first - DELAY_MARGIN) & (
        samples["time"] < span.last + DELAY_MARGIN
    )
    path = np.column_stack([samples[axis][near] for axis in "xyz"])
    return Trajectory(samples["time"][near], path)


def _delay(raw: Raw, view: View, span: Span, series: FrameSeries) -> Delay:
    fault = raw.faults[view]
    try:
        return fit_delay(
            series,
            _way_near(raw.samples, span),
            raw.provenance.cameras[view],
            raw.provenance.rig.camera(view).marker,
        )
    except DelayError as err:
        raise RigError(
            f"{err}; {fault}" if fault else str(err),
            where=f"view {view}",
            fix="see the video; the marker must be in view",
        ) from err


def _seen(span: Span, series: FrameSeries, delay: float, where: str, fault: str) -> Span:
    """The part of the span in which a view has seen the stick, up to `LONGEST_GAP` at its ends."""
    time = series.stamp[series.lines.good] - delay
    time = time[(time >= span.first) & (time <= span.last)]
    if len(time) == 0:
        raise RigError(
            "the stick is not seen during the stir",
            where=where,
            fix="see the video; the stick must stand out from what is behind it",
        )
    late, early = time[0] - span.first, span.last - time[-1]
    if early > LONGEST_GAP:
        unseen = f"{where} has not seen the stick for its last {early:.2f} s"
        cut = f"{where}: {fault}" if fault else unseen
        span = Span(span.first, float(time[-1]), cut)
    if late > LONGEST_GAP:
        cut = f"{where} has not seen the stick for its first {late:.2f} s"
        span = Span(float(time[0]), span.last, cut)
    return span


def _check_length(span: Span, where: str) -> None:
    if span.last - span.first < LEAST_TIME:
        reason = f" ({span.cut})" if span.cut else ""
        raise RigError(
            f"{max(span.last - span.first, 0.0):.2f} s of a stir{reason}",
            where=where,
            fix=f"at least {LEAST_TIME:g} s are needed; record again",
        )
