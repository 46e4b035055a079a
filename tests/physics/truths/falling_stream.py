"""A stream that falls freely: no air, no surface tension, no viscous stress in it."""

import numpy as np
from numpy.typing import ArrayLike

from .surfaces import GRAVITY


def fall_speed(speed: ArrayLike, drop: ArrayLike, gravity: float = GRAVITY) -> np.ndarray:
    """Speed [m/s] of a stream after a drop [m]: v² = v0² + 2 g h (Torricelli, Bernoulli)."""
    return np.sqrt(np.asarray(speed, float) ** 2 + 2.0 * gravity * np.asarray(drop, float))
