"""Measure frames: marker, stick's line, flags."""

from typing import NamedTuple

import numpy as np

from .frame import Flag, Frame, FrameMeasurement, line_is_good
from .marker import Marker, find_marker
from .stick_line import (
    NO_LINE,
    Edges,
    Line,
    Ray,
    Rows,
    find_edges,
    fit_line,
    moment_slope,
    sampled_rows,
    search_rays,
)
from .stick_view import StickView

LEAST_RESPONSE = 12.0  # grey levels
RIVAL_SHARE = 0.6  # of the best ray's response
LEAST_ROWS = 40
LEAST_ROWS_SHARE = 0.5
WIDTH_TOLERANCE = 0.35  # of the stick's width: it depends on the depth and the other inclination
ROW_WIDTH_TOLERANCE = 0.7  # px across the stick: one edge of such a row is something else
MOST_DISAGREEMENT = np.radians(0.5)
MAX_SWING_RATE = 8.0  # rad/s; a pendulum of 22 cm does 2 rad/s after a swing of 17 degrees
JUMP_ALLOWANCE = np.radians(1.0)
OFF_PIVOT = 0.0025  # m
SATURATED_SHARE = 0.10
# Grey levels beside the stick vary slowly, and the edges with them. This tilt over the stick's
# length, found with a cluttered background, is nothing that the scatter of the rows shows.
SYSTEMATIC_ERROR = 0.025  # px
HIDDEN_SEARCH = 40.0  # px on both sides of where the marker was


class Track(NamedTuple):
    """Memory of earlier frames for the next.

    Attributes:
        pivot: Column and row [px], None before the first marker.
        angle: Of the last good line [rad], NaN before the first.
        stamp: Of the last good line [s].
        image: The last picture, to see it again.
    """

    pivot: tuple[float, float] | None = None
    angle: float = float("nan")
    stamp: float = float("nan")
    image: np.ndarray | None = None


class _Stick(NamedTuple):
    """The stick in one picture, before it is compared with other pictures."""

    line: Line = NO_LINE
    second_angle: float = float("nan")
    flags: Flag = Flag.NOT_FOUND


def measure(frame: Frame, view: StickView, track: Track) -> tuple[FrameMeasurement, Track]:
    """Measure one frame.

    Args:
        frame: The picture.
        view: What is known of the view.
        track: What earlier frames told; `Track()` at first.

    Returns:
        The measurement, and the track for the next frame.

    Raises:
        ValueError: the picture has another size than the camera model.
    """
    image = frame.image
    if image.shape != view.camera.size[::-1] or image.dtype != np.uint8:
        raise ValueError(
            f"frame {frame.index} is {image.dtype} of shape {image.shape}; the camera model is "
            f"for grey uint8 of shape {view.camera.size[::-1]}: calibrate at the size you record"
        )
    marker = find_marker(image, view.scene.marker_radius * view.scale)
    pivot = _pivot(marker, view) if marker is not None else track.pivot
    stick = _find_stick(image, view, pivot, known=marker is not None)
    flags = stick.flags | (Flag(0) if marker is not None else Flag.NO_MARKER)
    if track.image is not None and np.array_equal(image, track.image):
        flags |= Flag.REPEATED_IMAGE
    angle = float(np.arctan(stick.line.slope))
    if _jumps(angle, frame.stamp, track):
        flags |= Flag.JUMP
    measurement = _as_measurement(frame, marker, stick, flags)
    good = line_is_good(flags)
    return measurement, Track(
        pivot=pivot,
        angle=angle if good else track.angle,
        stamp=frame.stamp if good else track.stamp,
        image=image,
    )


class FrameMeter:
    """Measures frame after frame of one camera."""

    def __init__(self, view: StickView) -> None:
        self._view = view
        self._track = Track()

    def measure(self, frame: Frame) -> FrameMeasurement:
        """Measure the next frame; see `measure`."""
        measurement, self._track = measure(frame, self._view, self._track)
        return measurement


def _pivot(marker: Marker, view: StickView) -> tuple[float, float]:
    """Pivot in the picture [px]; its depth is taken as that above the cup's middle."""
    place = view.camera.place(np.array([marker.column, marker.row]), view.marker_depth)
    column, row = view.camera.project(place - np.array(view.scene.marker_offset))
    return float(column), float(row)


def _find_stick(
    image: np.ndarray, view: StickView, pivot: tuple[float, float] | None, *, known: bool
) -> _Stick:
    if pivot is None:
        return _Stick()
    rows = _rows(pivot, view)
    if rows.last - rows.first < LEAST_ROWS:
        return _Stick()
    sign = -1.0 if view.contrast == "dark" else 1.0
    width, length = 2.0 * view.scene.stick_radius * view.scale, view.scene.stick_length * view.scale
    reach, step = (3.0, 1.5) if known else (HIDDEN_SEARCH, 4.0)
    columns = pivot[0] + np.arange(-reach, reach + 0.1, step)
    lines = sampled_rows(image, sign, rows)
    ray = search_rays(lines, columns, pivot[1], rows, width=width, length=length)
    if ray.response < LEAST_RESPONSE:
        return _Stick()
    reached = min(rows.last, int(pivot[1] + 0.97 * length / np.hypot(1.0, ray.slope)))
    rows = Rows(rows.first, reached)
    if rows.last - rows.first < LEAST_ROWS:
        return _Stick()
    edges = find_edges(image, sign, ray, rows, width)
    stick = _line_of(edges, ray, width, view)
    if ray.rival > RIVAL_SHARE * ray.response:
        stick = stick._replace(flags=stick.flags | Flag.AMBIGUOUS)
    if known and _misses(stick.line, pivot, view):
        return stick._replace(flags=stick.flags | Flag.OFF_PIVOT)
    return stick


def _rows(pivot: tuple[float, float], view: StickView) -> Rows:
    """Rows from below the gripper to above the liquid's surface."""
    hidden = view.scene.gripper_below * 1.3 * view.scale + 4.0
    first = max(int(np.ceil(pivot[1] + hidden)), 0)
    return Rows(first, min(int(view.last_row), view.camera.size[1]))


def _line_of(edges: Edges, ray: Ray, width: float, view: StickView) -> _Stick:
    """Line through the middles of the edges, and the doubts that this picture alone raises."""
    stretch = float(np.hypot(1.0, ray.slope))
    found = edges.right - edges.left
    clear = edges.contrast > 0.5 * max(float(np.median(edges.contrast)), LEAST_RESPONSE)
    clear &= np.isfinite(found)
    if clear.sum() < LEAST_ROWS // 2:
        return _Stick()
    usual = _usual_width(edges.row, found, clear)
    flags = Flag(0)
    if abs(float(np.median(usual)) - width * stretch) > WIDTH_TOLERANCE * width * stretch:
        flags |= Flag.WIDTH
    kept = clear & (np.abs(found - usual) < ROW_WIDTH_TOLERANCE * stretch)
    middle = np.column_stack([0.5 * (edges.left + edges.right), edges.row])[kept]
    line = fit_line(view.camera.undistort(middle))
    second = _second_angle(edges, clear, view)
    if line is NO_LINE:
        return _Stick(line, second, flags | Flag.NOT_FOUND)
    line = _with_systematic(line, middle, view)
    if np.sum(line.inlier) < max(LEAST_ROWS, LEAST_ROWS_SHARE * len(edges.row)):
        flags |= Flag.FEW_ROWS
    if not abs(np.arctan(line.slope) - second) < MOST_DISAGREEMENT + 4.0 * line.slope_error:
        flags |= Flag.DISAGREE
    if edges.saturated > SATURATED_SHARE:
        flags |= Flag.SATURATED
    return _Stick(line, second, flags)


def _with_systematic(line: Line, middle: np.ndarray, view: StickView) -> Line:
    rows = middle[line.inlier, 1]
    tilt = SYSTEMATIC_ERROR / max(float(np.ptp(rows)), 1.0)
    shift = SYSTEMATIC_ERROR / view.camera.focal[0]
    return line._replace(
        slope_error=float(np.hypot(line.slope_error, tilt)),
        offset_error=float(np.hypot(line.offset_error, shift)),
    )


def _usual_width(row: np.ndarray, found: np.ndarray, clear: np.ndarray) -> np.ndarray:
    """Width of the stick in every row [px]: it grows evenly as the stick comes nearer."""
    line = fit_line(np.column_stack([found, row])[clear])
    if line is NO_LINE:
        return np.full(len(row), float(np.median(found[clear])))
    return line.offset + line.slope * row


def _second_angle(edges: Edges, clear: np.ndarray, view: StickView) -> float:
    """Angle [rad] by the moments of the stick's area."""
    row, mass, centroid = edges.row[clear], edges.mass[clear], edges.centroid[clear]
    slope = moment_slope(row, centroid, mass)
    ends = np.array([row[0], row[-1]], dtype=float)
    middle = float(mass @ centroid / mass.sum())
    columns = middle + slope * (ends - float(mass @ row / mass.sum()))
    (x0, y0), (x1, y1) = view.camera.undistort(np.column_stack([columns, ends]))
    return float(np.arctan2(x1 - x0, y1 - y0))


def _misses(line: Line, pivot: tuple[float, float], view: StickView) -> bool:
    x, y = view.camera.undistort(np.array(pivot))
    apart = abs(line.offset + line.slope * y - x) / np.hypot(1.0, line.slope)
    return bool(apart * view.marker_depth > OFF_PIVOT)


def _jumps(angle: float, stamp: float, track: Track) -> bool:
    turned = abs(angle - track.angle)
    return bool(turned > MAX_SWING_RATE * abs(stamp - track.stamp) + JUMP_ALLOWANCE)


def _as_measurement(
    frame: Frame, marker: Marker | None, stick: _Stick, flags: Flag
) -> FrameMeasurement:
    nan, line = float("nan"), stick.line
    return FrameMeasurement(
        index=frame.index,
        stamp=frame.stamp,
        marker_column=marker.column if marker is not None else nan,
        marker_row=marker.row if marker is not None else nan,
        angle=float(np.arctan(line.slope)),
        offset=line.offset,
        angle_error=line.slope_error / (1.0 + line.slope**2),
        offset_error=line.offset_error,
        second_angle=stick.second_angle,
        rows=int(line.inlier.sum()),
        flags=int(flags),
    )
