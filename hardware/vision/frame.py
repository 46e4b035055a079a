"""A picture with its time, what it tells, and whether to believe it."""

from enum import IntFlag
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MAX_STEP = 0.5  # [s] between two pictures; no camera is as slow


class Frame(NamedTuple):
    """One picture.

    Attributes:
        index: Counts the camera's frames from 0; a number that is left out is a lost frame.
        stamp: When a camera gave it, on this computer's clock, `time.monotonic()` [s]; of a file,
            its own time.
        image: Grey levels, uint8, shape (height, width).
    """

    index: int  # pyright: ignore[reportIncompatibleMethodOverride]
    stamp: float
    image: np.ndarray


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


def stamp_fault(step: float, index: int, after: float) -> str:
    """Message for a stamp that does not follow the one before it, else an empty string.

    Args:
        step: Its stamp less the one before it [s].
        index: Of the picture.
        after: From the camera's first picture to the last good one [s].
    """
    if 0.0 < step < MAX_STEP:
        return ""
    what = f"jump by {step:.2f} s" if step > 0.0 else "stand still or go back"
    return (
        f"its stamps {what} at frame {index} ({after:.1f} s): check its cable and what else this "
        "computer does, or take another camera"
    )


def first_fault(
    index: NDArray[np.float64], stamp: NDArray[np.float64], begin: float
) -> tuple[int, str]:
    """First row whose stamp is refused, and the message; (N, "") if there is none.

    Args:
        index: Of the pictures, shape (N,).
        stamp: On this computer's clock [s], shape (N,).
        begin: Of the stir [s]; pictures may be lost before it.
    """
    step = np.diff(stamp)
    usable = (step > 0.0) & ((step < MAX_STEP) | (stamp[1:] < begin))
    if usable.all():
        return len(stamp), ""
    row = 1 + int(np.argmin(usable))
    after = float(stamp[row - 1] - stamp[0])
    return row, stamp_fault(float(step[row - 1]), int(index[row]), after)
