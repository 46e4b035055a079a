"""Where a point was, or shall be, and when."""

from typing import NamedTuple

import numpy as np


class Trajectory(NamedTuple):
    """Times [s], shape [T], increasing, and positions [m], shape [T, 3], in the cup's frame."""

    time: np.ndarray
    position: np.ndarray
