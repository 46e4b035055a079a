"""The staggered grid: cells in a box around a vessel, and points of cells and faces."""

import math
from dataclasses import dataclass

import numpy as np

WALL = 2  # layers of cells around the vessel's inside: one of wall, one that no stencil leaves
AIR = 3  # layers of air above the liquid


@dataclass(frozen=True)
class Grid:
    """Cells of a box, numbered with x fastest: m = (k ny + j) nx + i.

    Attributes:
        cell: Edge of a cell [m].
        shape: Cells along x, y and z.
        origin: Lowest corner of the box [m].
        mirrored: Whether y = 0 is a mirror, behind `WALL` layers of cells.
    """

    cell: float
    shape: tuple[int, int, int]
    origin: tuple[float, float, float]
    mirrored: bool = False

    @classmethod
    def around_cup(cls, cell: float, radius: float, depth: float) -> "Grid":
        """The grid of a cup whose floor's centre is the origin, with liquid of `depth` [m]."""
        across = 2 * math.ceil(radius / cell - 1e-6) + 2 * WALL
        up = math.ceil(depth / cell - 1e-6) + AIR + WALL + 1
        side = -0.5 * across * cell
        return cls(cell, (across, across, up), (side, side, -WALL * cell))

    @property
    def cells(self) -> int:
        return math.prod(self.shape)

    @property
    def strides(self) -> tuple[int, int, int]:
        """Distance of neighbours in the numbering, along x, y and z."""
        return 1, self.shape[0], self.shape[0] * self.shape[1]

    def points(self, at: tuple[float, ...]) -> np.ndarray:
        """A point of each cell [m], shape (cells, 3); `at` is its place in the cell, in cells."""
        nx, ny, nz = self.shape
        k, j, i = np.meshgrid(range(nz), range(ny), range(nx), indexing="ij")
        index = np.stack([i.ravel(), j.ravel(), k.ravel()], axis=1)
        return np.array(self.origin) + (index + np.array(at)) * self.cell

    def faces(self, axis: int) -> np.ndarray:
        """Centres of each cell's lower face along an axis [m], shape (cells, 3)."""
        return self.points(tuple(0.0 if axis == a else 0.5 for a in range(3)))

    def inner(self) -> np.ndarray:
        """Which cells are neither on the box's outside nor before the mirror, bool (cells,)."""
        nx, ny, nz = self.shape
        inside = np.zeros((nz, ny, nx), bool)
        inside[1:-1, 1:-1, 1:-1] = True
        if self.mirrored:
            inside[:, :WALL] = False
        return inside.ravel()
