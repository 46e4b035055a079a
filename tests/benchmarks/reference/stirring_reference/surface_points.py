"""Where the points of a stick's, a cup's and a cylinder's surface are, about a cell apart."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .box import Box

RINGS_ABOVE = 4  # of the stick's side beyond the surface at rest, for when it leans


class StickPoints(NamedTuple):
    """Points on the lower part of a stick, in its own frame.

    Attributes:
        along: From the end towards the pivot [m], shape [n].
        across: From the axis [m], shape [n, 2].
        volume: Of the liquid that each point moves, one cell thick [m³], shape [n].
    """

    along: NDArray[np.float64]
    across: NDArray[np.float64]
    volume: NDArray[np.float64]


def check_radius(radius: float, cell: float) -> None:
    """Refuse a body that its own points would not enclose.

    Raises:
        ValueError: the radius is less than a cell.
    """
    if radius < cell:
        raise ValueError(
            f"a radius of {radius} m is not resolved by cells of {cell:.4g} m; take smaller ones"
        )


def stick_points(radius: float, submerged: float, cell: float, drawn_in: float) -> StickPoints:
    """Rings around the side, and on the flat end.

    Args:
        radius, submerged: Of the stick, and its length in the liquid [m].
        cell: Distance of the points [m].
        drawn_in: How far they stand behind the surface, in cells.
    """
    inner, depth = radius - drawn_in * cell, drawn_in * cell
    rings = [*_side(inner, depth, submerged, cell), *_flat_end(inner, depth, cell)]
    along, across, volume = (np.concatenate(column) for column in zip(*rings, strict=True))
    return StickPoints(along, across, volume)


def _side(radius: float, depth: float, submerged: float, cell: float) -> list[StickPoints]:
    count = points_around(radius, cell)
    volume = 2.0 * math.pi * radius / count * cell**2
    return [
        _ring(count, radius, depth + (ring + 0.5) * cell, volume, staggered=ring % 2 == 1)
        for ring in range(math.ceil(submerged / cell) + RINGS_ABOVE)
    ]


def _flat_end(radius: float, depth: float, cell: float) -> list[StickPoints]:
    rings = max(1, round(radius / cell))
    width = radius / rings
    found = []
    for ring in range(rings):
        middle = (ring + 0.5) * width
        count = 4 if rings == 1 else max(1, round(2.0 * math.pi * middle / cell))
        volume = 2.0 * math.pi * middle * width / count * cell
        found.append(_ring(count, middle, depth, volume, staggered=ring % 2 == 1))
    return found


def _ring(
    count: int, radius: float, along: float, volume: float, *, staggered: bool
) -> StickPoints:
    angle = (np.arange(count) + 0.5 * staggered) * 2.0 * np.pi / count
    across = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return StickPoints(np.full(count, along), across, np.full(count, volume))


def points_around(radius: float, cell: float) -> int:
    """How many points go around a circle [m]."""
    return max(6, math.ceil(2.0 * math.pi * radius / cell))


def layered_ring(
    box: Box, radius: float, count: int, middle: tuple[float, float] = (0.0, 0.0)
) -> tuple[NDArray[np.float64], float]:
    """`count` points around the vertical through `middle` [m], on each layer of the box.

    Returns:
        The points [m], shape [layers count, 3], and the volume of liquid that each moves [m³].
    """
    angle = 2.0 * np.pi * np.arange(count) / count
    x, y = middle[0] + radius * np.cos(angle), middle[1] + radius * np.sin(angle)
    layers = box.shape[2]
    height = (np.arange(layers) + 0.5) * box.cell
    columns = [np.tile(x, layers), np.tile(y, layers), np.repeat(height, count)]
    points = np.asarray(np.column_stack(columns), np.float64)
    return points, 2.0 * math.pi * radius / count * box.cell**2
