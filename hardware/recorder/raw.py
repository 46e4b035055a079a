"""What a session has left in its directory, as arrays; whatever is missing is said."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..csv_file import read_csv
from ..errors import RigError
from ..rig import View
from ..safety.guards import MAX_CLOCK_DRIFT
from ..vision.frame_measurement import FrameMeasurement
from .directory import VIEWS, Provenance, read_provenance
from .names import frames_file
from .sample import SAMPLES, Sample
from .stamps import first_fault

LEAST_SAMPLES = 50
LEAST_FRAMES = 30
Columns = dict[str, NDArray[np.float64]]


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
    """How many rows are missing from a table: what its rising index leaves out, shape (N,)."""
    return int(index[-1] - index[0] + 1 - len(index))


def missed(clock: NDArray[np.float64]) -> int:
    """How many times a source's clock leaves out: what it sent and nobody fetched.

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
