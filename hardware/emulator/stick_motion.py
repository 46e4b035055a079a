"""How a stick hangs while its pivot goes along a path: a table that somebody else has made."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

COLUMNS = 6  # of a table's file: time, x, y, z, inclination in xz and in yz


class StickMotion(NamedTuple):
    """A stir as a table; whoever takes one says in which frame it is.

    Attributes:
        time: From its start [s], shape (T,), increasing.
        pivot: Position of the stick's upper end [m], shape (T, 3).
        inclination: From the downward vertical in the frame's xz and yz planes [rad], shape (T, 2),
            positive with the tip towards +x and +y.
    """

    time: np.ndarray
    pivot: np.ndarray
    inclination: np.ndarray


def checked(motion: StickMotion) -> StickMotion:
    """The motion as it is.

    Raises:
        ValueError: Shapes do not agree, a number is not finite, or times do not rise.
    """
    size = len(motion.time)
    shapes = tuple(np.shape(part) for part in motion)
    if size < 2 or shapes != ((size,), (size, 3), (size, 2)):
        raise ValueError(
            f"a stick's motion has times, pivots and inclinations of shapes {shapes}; "
            "give (T,), (T, 3) and (T, 2) of at least two rows"
        )
    for name, values in motion._asdict().items():
        if not np.isfinite(values).all():
            raise ValueError(f"a stick's motion has a {name} that is not finite; give numbers only")
    if not (np.diff(motion.time) > 0.0).all():
        raise ValueError("the times of a stick's motion do not rise; sort its rows")
    return motion


def hanging_still(pivot: np.ndarray) -> StickMotion:
    """Of a stick that hangs straight down below a pivot [m], shape (3,)."""
    return StickMotion(np.array([0.0, 1.0]), np.tile(pivot[:3], (2, 1)), np.zeros((2, 2)))


def write(motion: StickMotion, path: str | Path) -> None:
    """Write a motion for `read`.

    Raises:
        ValueError: See `checked`.
    """
    time, pivot, inclination = checked(motion)
    np.save(path, np.column_stack([time, pivot, inclination]), allow_pickle=False)


def read(path: str | Path) -> StickMotion:
    """The motion of a file, a NumPy array of the six columns of `COLUMNS`.

    Raises:
        ValueError: It cannot be read, or see `checked`.
    """
    try:
        rows = np.load(path, allow_pickle=False)
    except (OSError, EOFError) as err:
        raise ValueError(f"{path}: {err}; name a file of a stick's motion") from err
    if rows.ndim != 2 or rows.shape[1] != COLUMNS:
        raise ValueError(f"{path} holds shape {rows.shape}; give rows of {COLUMNS} columns")
    return checked(StickMotion(rows[:, 0], rows[:, 1:4], rows[:, 4:]))
