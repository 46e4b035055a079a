"""What one frame tells: the marker's place, the stick's line, and whether to believe it."""

from enum import IntFlag
from typing import NamedTuple


class Flag(IntFlag):
    """Doubts about a frame; a frame without any has 0."""

    NOT_FOUND = 1  # no stick
    FEW_ROWS = 2  # the stick is hidden over too much of its length
    DISAGREE = 4  # edges and area give different angles
    JUMP = 8  # turned faster than a stick can
    SATURATED = 16  # glare, or too long an exposure
    REPEATED_IMAGE = 32  # the camera delivered the same picture again
    NO_MARKER = 64  # the marker is hidden: nothing is wrong with the line
    OFF_PIVOT = 128  # the line misses the pivot that the marker shows
    WIDTH = 256  # not as wide as the stick
    AMBIGUOUS = 512  # something else looks like a stick too
    GAP = 1024  # in joined series: no good frame near enough in time


MARKER_ONLY = Flag.NO_MARKER
BAD_LINE = ~MARKER_ONLY


class FrameMeasurement(NamedTuple):
    """One row of `frames_<view>.csv`.

    Attributes:
        index: Of the frame.
        stamp: When the camera gave it, on this computer's clock [s].
        marker_column, marker_row: Centre of the marker [px], NaN when it was not found.
        angle: Of the stick's line in undistorted coordinates, from the picture's downward
            vertical, positive to the right [rad]; NaN when there is none.
        offset: Where the line crosses the height of the lens' axis, in focal lengths.
        angle_error: Standard error of `angle` [rad].
        offset_error: Standard error of `offset`.
        second_angle: By the moments of the stick's area [rad].
        rows: Rows of the picture that lie on the line.
        flags: A `Flag` as a number.
    """

    index: int  # pyright: ignore[reportIncompatibleMethodOverride]
    stamp: float
    marker_column: float
    marker_row: float
    angle: float
    offset: float
    angle_error: float
    offset_error: float
    second_angle: float
    rows: int
    flags: int


def line_is_good(flags: int) -> bool:
    """Whether the line of a frame with these flags may be used."""
    return not flags & BAD_LINE
