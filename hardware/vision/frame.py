"""A picture with its times."""

from typing import NamedTuple

import numpy as np


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
