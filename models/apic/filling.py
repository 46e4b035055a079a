"""Initial positions of the particles in a filled vessel."""

from typing import NamedTuple

import numpy as np

from .grid import Grid

POINTS = {
    2: [(0.25, 0.25, 0.25), (0.75, 0.75, 0.75)],
    4: [(0.25, 0.25, 0.25), (0.75, 0.75, 0.25), (0.25, 0.75, 0.75), (0.75, 0.25, 0.75)],
}
"""Of a cell, in cells, by how many there are: lattices whose deposit fills each cell alike, and of
which the lower half of a cell has half the points."""

JITTER = 0.1  # of the distance of particles, to either side
OFF_WALL = 0.02  # cells that particles keep from walls, at the start and later


class Cylinder(NamedTuple):
    """The inside of a cup: its radius, and the centre of its floor [m]."""

    radius: float
    floor: tuple[float, float, float] = (0.0, 0.0, 0.0)


def fill_cup(grid: Grid, cup: Cylinder, fill: float, per_cell: int, seed: int) -> np.ndarray:
    """Particles of liquid of depth `fill` in a cup [m], shape (n, 3).

    The lattice is the grid's. Its layers of half a cell are stretched so that a whole number of
    them reaches from the floor to the level.
    """
    if fill <= 0.0:
        return np.empty((0, 3))
    corners = grid.points((0.0, 0.0, 0.0))[grid.inner()]
    points = np.concatenate([corners + grid.cell * np.array(at) for at in POINTS[per_cell]])
    points[:, :2] -= cup.floor[:2]
    points[:, 2] -= round(cup.floor[2] / grid.cell) * grid.cell
    layers = max(round(2.0 * fill / grid.cell), 1) / 2.0 * grid.cell
    points[:, 2] *= fill / layers
    across = np.hypot(points[:, 0], points[:, 1])
    inside = (across < cup.radius) & (points[:, 2] > 0.0) & (points[:, 2] < fill - 1e-6)
    spacing = grid.cell / per_cell ** (1.0 / 3.0)
    rng = np.random.default_rng(seed)
    points = points[inside] + JITTER * spacing * rng.uniform(-1.0, 1.0, (inside.sum(), 3))
    across = np.hypot(points[:, 0], points[:, 1])
    points[:, :2] *= np.minimum(1.0, (cup.radius - OFF_WALL * grid.cell) / across)[:, None]
    points[:, 2] = np.maximum(points[:, 2], OFF_WALL * grid.cell)
    return points + cup.floor
