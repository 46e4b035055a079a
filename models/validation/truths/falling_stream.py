"""A stream that falls freely: no air, no surface tension, no viscous stress in it."""

import numpy as np
from numpy.typing import ArrayLike

from .surfaces import GRAVITY


def fall_speed(speed: ArrayLike, drop: ArrayLike, gravity: float = GRAVITY) -> np.ndarray:
    """Speed [m/s] of a stream after a drop [m]: v² = v0² + 2 g h (Torricelli, Bernoulli)."""
    return np.sqrt(np.asarray(speed, float) ** 2 + 2.0 * gravity * np.asarray(drop, float))


def stream_area(
    area: ArrayLike, speed: ArrayLike, drop: ArrayLike, gravity: float = GRAVITY
) -> np.ndarray:
    """Cross-section of a steady vertical stream after a drop [m], as it carries the same volume.

    Args:
        area: Where the drop begins [m²]; the width [m] of a stream between two walls is likewise.
        speed: There, downward [m/s].
    """
    return np.asarray(area, float) * np.asarray(speed, float) / fall_speed(speed, drop, gravity)


def momentum_flux(
    flux: ArrayLike, speed: ArrayLike, drop: ArrayLike, density: float, gravity: float = GRAVITY
) -> np.ndarray:
    """Momentum [N] that a steady vertical stream carries through a level after a drop: ρ Q v.

    It grows by the weight of the stream in between.

    Args:
        flux: Volume that the stream carries, Q [m³/s].
    """
    return density * np.asarray(flux, float) * fall_speed(speed, drop, gravity)


def landing(
    velocity: ArrayLike, drop: ArrayLike, gravity: float = GRAVITY
) -> tuple[np.ndarray, np.ndarray]:
    """Where and when liquid lands that leaves an edge freely.

    Args:
        velocity: Horizontal and upward [m/s], shape [..., 2].
        drop: From the edge down [m], positive.

    Returns:
        Distance from the edge [m] and time [s].
    """
    ahead, up = np.moveaxis(np.asarray(velocity, float), -1, 0)
    time = (up + np.sqrt(up**2 + 2.0 * gravity * np.asarray(drop, float))) / gravity
    return ahead * time, time
