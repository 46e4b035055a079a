"""A camera's measurements over time, and their values between the frames."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .frame_measurement import BAD_LINE, Flag
from .inclination import ViewLines

LONGEST_GAP = 0.1  # s between the good frames on both sides
NEIGHBOURS = 2  # on each side


class FrameSeries(NamedTuple):
    """Measurements of one view; all of shape (N,), one row a frame.

    Attributes:
        stamp: When the camera gave it, on this computer's clock [s].
        marker: Column and row of the marker [px], shape (N, 2), NaN where it is hidden.
        lines: The stick's line.
        flags: `Flag` as numbers.
    """

    stamp: np.ndarray
    marker: np.ndarray
    lines: ViewLines
    flags: np.ndarray


class Interpolated(NamedTuple):
    """Lines between the frames.

    Attributes:
        lines: At T times; NaN where no good frame is near.
        flags: Of the frames around; with `Flag.GAP` where the lines are NaN. Shape (T,).
    """

    lines: ViewLines
    flags: np.ndarray


def frame_series(columns: Mapping[str, np.ndarray]) -> FrameSeries:
    """Columns of `FrameMeasurement` as a series; stamps rise."""
    return FrameSeries(
        stamp=columns["stamp"],
        marker=np.column_stack([columns["marker_column"], columns["marker_row"]]),
        lines=ViewLines(*(columns[name] for name in ViewLines._fields)),
        flags=columns["flags"].astype(np.int64),
    )


def interpolate_lines(series: FrameSeries, stamps: np.ndarray) -> Interpolated:
    """Lines at other times, by cubics through the nearest good frames.

    Frames whose line is doubtful are passed over. There are two neighbours on each side, one
    where the second is more than `LONGEST_GAP` away, and none across a longer gap.

    Args:
        series: Of one view.
        stamps: Wanted times [s], shape (T,).
    """
    stamps = np.asarray(stamps, dtype=float)
    usable = ((series.flags & int(BAD_LINE)) == 0) & np.isfinite(series.lines.angle)
    time = series.stamp[usable]
    flags = _flags_around(series, stamps)
    if len(time) < 2:
        nothing = np.full(stamps.shape, np.nan)
        return Interpolated(ViewLines(*([nothing] * 4)), flags | int(Flag.GAP))
    index, weight = _cubic_weights(time, stamps)
    lines = ViewLines(*(values[usable] for values in series.lines))
    good = np.isfinite(weight).all(axis=1)
    return Interpolated(
        ViewLines(
            angle=np.sum(weight * lines.angle[index], axis=1),
            offset=np.sum(weight * lines.offset[index], axis=1),
            angle_error=np.sqrt(np.sum((weight * lines.angle_error[index]) ** 2, axis=1)),
            offset_error=np.sqrt(np.sum((weight * lines.offset_error[index]) ** 2, axis=1)),
        ),
        np.where(good, 0, flags | int(Flag.GAP)),
    )


def _cubic_weights(time: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours and Lagrange's weights for each wanted time, both of shape (T, 4).

    Weights are NaN where the time is outside all frames or in too long a gap.
    """
    after = np.clip(np.searchsorted(time, wanted, side="right"), 1, len(time) - 1)
    index = after[:, None] + np.arange(-NEIGHBOURS, NEIGHBOURS)
    inside = (index >= 0) & (index < len(time))
    index = np.clip(index, 0, len(time) - 1)
    nodes = time[index]
    # an outer neighbour that is far from the inner one says little about now
    inside[:, 0] &= nodes[:, 1] - nodes[:, 0] <= LONGEST_GAP
    inside[:, 3] &= nodes[:, 3] - nodes[:, 2] <= LONGEST_GAP
    weight = np.where(inside, 1.0, 0.0)
    for k in range(2 * NEIGHBOURS):
        for other in range(2 * NEIGHBOURS):
            if other != k:
                apart = nodes[:, k] - nodes[:, other]
                both = inside[:, k] & inside[:, other]
                factor = (wanted - nodes[:, other]) / np.where(both, apart, 1.0)
                weight[:, k] *= np.where(both, factor, 1.0)
    allowed = (nodes[:, 2] - nodes[:, 1] <= LONGEST_GAP) & _within(time, wanted)
    weight[~allowed] = np.nan
    return index, weight


def _within(time: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    rounding = 1e-9
    return (wanted >= time[0] - rounding) & (wanted <= time[-1] + rounding)


def _flags_around(series: FrameSeries, stamps: np.ndarray) -> np.ndarray:
    """Flags of the last frame before and the first after each time."""
    if len(series.stamp) == 0:
        return np.zeros(stamps.shape, dtype=np.int64)
    after = np.searchsorted(series.stamp, stamps)
    last = len(series.stamp) - 1
    return series.flags[np.clip(after - 1, 0, last)] | series.flags[np.clip(after, 0, last)]
