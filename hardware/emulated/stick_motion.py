"""How a stick hangs while its pivot goes along a path: a table that somebody else has made."""

from typing import NamedTuple

import numpy as np


class StickMotion(NamedTuple):
    """A stir as a table, in the cup's frame.

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
