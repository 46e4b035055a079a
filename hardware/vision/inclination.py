"""The stick's inclination at times of the robot's clock, from its lines in two views."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .camera_model import CameraModel
from .frame import BAD_LINE, Flag

LONGEST_GAP = 0.1  # s between the good frames on both sides
NEIGHBOURS = 2  # on each side


class ViewLines(NamedTuple):
    """The stick's line in one view, at T times; all of shape (T,).

    Attributes:
        angle: From the picture's downward vertical [rad], in undistorted coordinates.
        offset: Where the line crosses the height of the lens' axis, in focal lengths.
        angle_error: Standard error [rad].
        offset_error: Standard error.
        flags: `Flag` as numbers.
    """

    angle: np.ndarray
    offset: np.ndarray
    angle_error: np.ndarray
    offset_error: np.ndarray
    flags: np.ndarray

    @property
    def good(self) -> np.ndarray:
        """Which lines may be used."""
        return ((self.flags & int(BAD_LINE)) == 0) & np.isfinite(self.angle)


class FrameSeries(NamedTuple):
    """Measurements of one view, one row a frame.

    Attributes:
        stamp: When the camera gave it [s], shape (N,), rising.
        marker: Column and row of the marker [px], shape (N, 2), NaN where it is hidden.
        lines: The stick's line.
    """

    stamp: np.ndarray
    marker: np.ndarray
    lines: ViewLines


class MeasuredView(NamedTuple):
    """One camera's share: its measurements, stamped on the robot's clock, delay [s] and model."""

    series: FrameSeries
    delay: float
    camera: CameraModel


class Inclination(NamedTuple):
    """Angles of the stick from the downward vertical in the xz and yz planes.

    Attributes:
        angle: [rad], shape (T, 2), positive towards +x and +y; NaN where a view has no good frame
            near enough.
        error: Standard errors [rad], shape (T, 2).
        flags: Why there is none, as `Flag`; 0 where there is one. Shape (T,).
    """

    angle: np.ndarray
    error: np.ndarray
    flags: np.ndarray


def frame_series(columns: Mapping[str, np.ndarray]) -> FrameSeries:
    """Columns of `FrameMeasurement` as a series."""
    *numbers, flags = (columns[name] for name in ViewLines._fields)
    return FrameSeries(
        stamp=columns["stamp"],
        marker=np.column_stack([columns["marker_column"], columns["marker_row"]]),
        lines=ViewLines(*numbers, flags=flags.astype(np.int64)),
    )


def join(xz: MeasuredView, yz: MeasuredView, times: np.ndarray) -> Inclination:
    """Inclination of the stick from two cameras that do not take their frames together.

    Each view's line is interpolated to the wanted times, then both are joined.

    Args:
        xz: The camera that looks along +y.
        yz: The camera that looks along -x.
        times: Wanted times of the robot's clock [s], shape (T,).
    """
    seen_xz, seen_yz = (
        interpolate_lines(one.series, np.asarray(times) + one.delay) for one in (xz, yz)
    )
    return inclination(seen_xz, seen_yz, xz.camera, yz.camera)


def direction(
    xz: ViewLines, yz: ViewLines, camera_xz: CameraModel, camera_yz: CameraModel
) -> np.ndarray:
    """Unit vectors in the cup frame, shape (T, 3), from the pivot down the stick.

    A line in a picture and the lens span a plane that contains the stick; the stick lies where
    both views' planes meet.
    """
    cross = np.cross(_normals(xz, camera_xz), _normals(yz, camera_yz))
    length = np.linalg.norm(cross, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        return cross / length * np.where(cross[..., 2:] > 0, -1.0, 1.0)


def inclination(
    xz: ViewLines, yz: ViewLines, camera_xz: CameraModel, camera_yz: CameraModel
) -> Inclination:
    """Inclinations with standard errors, to first order, from the lines in two views.

    The errors hold for cameras that stand and look as their models say.
    """
    angles = _angles(direction(xz, yz, camera_xz, camera_yz))
    variance = np.zeros_like(angles)
    for changed_xz, changed_yz in _changed(xz, yz):
        moved = _angles(direction(changed_xz, changed_yz, camera_xz, camera_yz))
        variance += (moved - angles) ** 2
    return Inclination(angles, np.sqrt(variance), xz.flags | yz.flags)


def _changed(xz: ViewLines, yz: ViewLines) -> list[tuple[ViewLines, ViewLines]]:
    """Both views, with one number at a time moved by its standard error."""
    return [
        (xz._replace(angle=xz.angle + xz.angle_error), yz),
        (xz._replace(offset=xz.offset + xz.offset_error), yz),
        (xz, yz._replace(angle=yz.angle + yz.angle_error)),
        (xz, yz._replace(offset=yz.offset + yz.offset_error)),
    ]


def _normals(lines: ViewLines, camera: CameraModel) -> np.ndarray:
    """Normals in the cup frame, shape (T, 3), of the planes x - slope y - offset z = 0."""
    normal = np.stack([np.ones_like(lines.angle), -np.tan(lines.angle), -lines.offset], axis=-1)
    return normal @ camera.rotation


def _angles(down: np.ndarray) -> np.ndarray:
    return np.arctan2(down[..., :2], -down[..., 2:])


def interpolate_lines(series: FrameSeries, stamps: np.ndarray) -> ViewLines:
    """Lines at other times, by cubics through the nearest good frames.

    Frames whose line is doubtful are passed over. There are two neighbours on each side, one
    where the second is more than `LONGEST_GAP` away, and none across a longer gap: a line is then
    NaN, and has the flags of the frames around, and `Flag.GAP`.

    Args:
        series: Of one view.
        stamps: Wanted times [s], shape (T,).
    """
    usable = series.lines.good
    time, flags = series.stamp[usable], _flags_around(series, stamps) | int(Flag.GAP)
    if len(time) < 2:
        nothing = np.full(stamps.shape, np.nan)
        return ViewLines(nothing, nothing, nothing, nothing, flags)
    index, weight = _cubic_weights(time, stamps)
    lines = ViewLines(*(values[usable][index] for values in series.lines))
    return ViewLines(
        angle=np.sum(weight * lines.angle, axis=1),
        offset=np.sum(weight * lines.offset, axis=1),
        angle_error=np.sqrt(np.sum((weight * lines.angle_error) ** 2, axis=1)),
        offset_error=np.sqrt(np.sum((weight * lines.offset_error) ** 2, axis=1)),
        flags=np.where(np.isfinite(weight).all(axis=1), 0, flags),
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
    flags = series.lines.flags
    if len(flags) == 0:
        return np.zeros(stamps.shape, dtype=np.int64)
    after = np.searchsorted(series.stamp, stamps)
    last = len(flags) - 1
    return flags[np.clip(after - 1, 0, last)] | flags[np.clip(after, 0, last)]
