"""Where particles are: fronts, heights, shapes and pieces of a liquid."""

import numpy as np
from numpy.typing import ArrayLike


def front_position(
    positions: ArrayLike, spacing: float, *, axis: int = 0, strays: int = 3
) -> np.ndarray:
    """How far a liquid has come along an axis [m]: half a spacing beyond its foremost centres.

    Args:
        positions: Particle centres [m], shape [..., n, 3].
        spacing: Particle spacing [m].
        axis: Along which it spreads.
        strays: Foremost particles that do not count, as spray runs ahead of the front.

    Returns:
        Shape [...].

    Raises:
        ValueError: there are no more particles than strays.
    """
    along = np.asarray(positions, float)[..., axis]
    if along.shape[-1] <= strays:
        raise ValueError(f"{along.shape[-1]} particles have no front behind {strays} strays")
    return np.partition(along, -strays - 1, axis=-1)[..., -strays - 1] + 0.5 * spacing


def column_height(
    positions: ArrayLike, spacing: float, reach: float, *, axis: int = 0, strays: int = 3
) -> np.ndarray:
    """Height [m] of the liquid within `reach` [m] of the wall at 0; z is up.

    Shapes as `front_position`; NaN where no more than `strays` particles are left there.
    """
    positions = np.asarray(positions, float)
    height = np.where(positions[..., axis] < reach, positions[..., 2], -np.inf)
    top = np.partition(height, -strays - 1, axis=-1)[..., -strays - 1] + 0.5 * spacing
    return np.where(np.isfinite(top), top, np.nan)
