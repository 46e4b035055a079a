"""The cup that pours, in its own frame: cells, walls, and the region beyond which liquid flies.

The origin is the lip, the inner edge of the rim where liquid leaves. x points away from the cup, z
along its axis to the rim, and only y >= 0 is held, since both halves flow alike.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..apic.filling import Cylinder, fill_cup
from ..apic.geometry import ABOVE, INSIDE, NEAREST_OF_FILMS, OUTSIDE, Geometry, sample_geometry
from ..apic.grid import WALL, Grid
from .resolution import Filled, cell_for, particles_for

RIM = 0.002  # m, thickness of the wall; the rim is flat
BEYOND, OVER, UNDER = 38 / 28, 40 / 28, 25 / 28
"""How far the region reaches beyond the lip, above the rim and below it, in radii of the cup: the
references' own. Nearer, the stream would still be shaped by the rim."""
AIR = 3  # cells beyond the region: two without liquid, and one that no stencil leaves
BELOW_FLOOR = 0.02  # m of wall that nothing passes
COARSEST = 1.0  # cells in the cup's radius, at least; coarser ones may hold no particle
MOST_CELLS = 1_500_000  # which take 1 to 2 GB a processor


@dataclass(frozen=True)
class Vessel:
    """A cup of `radius` and `height` with liquid of depth `fill` [m], cut into cells [m]."""

    radius: float
    height: float
    fill: float
    cell: float

    @property
    def corners(self) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
        """Lowest and highest x, y and z [m] of the region; y is its size to either side."""
        across = math.ceil(2.0 * self.radius / self.cell - 1e-6) + 1
        aside = math.ceil(self.radius / self.cell - 1e-6) + 1
        down = math.ceil(self.height / self.cell - 1e-6) + 1
        return (
            (-across * self.cell, BEYOND * self.radius),
            (0.0, aside * self.cell),
            (-down * self.cell, OVER * self.radius),
        )

    @property
    def under(self) -> float:
        """Depth below the rim at which the region ends outside of the cup [m]."""
        return UNDER * self.radius

    def grid(self) -> Grid:
        """Lip, rim and mirror lie on faces, whatever the cells' size."""
        lows, highs = zip(*self.corners, strict=True)
        x, y, z = (round(-low / self.cell) + WALL for low in lows)
        nx, ny, nz = (math.ceil(high / self.cell - 1e-6) + AIR for high in highs)
        origin = -x * self.cell, -y * self.cell, -z * self.cell
        return Grid(self.cell, (x + nx, y + ny, z + nz), origin, mirrored=True)

    def distance(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Distance of points from the wall and the floor [m], negative within them."""
        out, bottom = np.hypot(x + self.radius, y), -self.height - BELOW_FLOOR
        wall = _from_ring(out, z, (self.radius, self.radius + RIM), (bottom, 0.0))
        floor = _from_ring(out, z, (-1.0, self.radius + RIM), (bottom, -self.height))
        return np.minimum(wall, floor)

    def side(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Side of the wall on which points lie."""
        out = np.hypot(x + self.radius, y)
        below = np.where(out < self.radius + 0.5 * RIM, INSIDE, OUTSIDE)
        return np.where(z > 0.0, ABOVE, below)

    def geometry(self) -> Geometry:
        """Open shares of cells and faces; nothing flows through the mirror."""
        return _geometry(self)

    def particles(self, per_cell: int, seed: int) -> np.ndarray:
        """Initial positions of the particles [m], shape (n, 3)."""
        cup = Cylinder(self.radius, (-self.radius, 0.0, -self.height))
        return fill_cup(self.grid(), cup, self.fill, per_cell, seed)


def vessel_of(cup: Filled, particles: int = 0) -> Vessel:
    """A cup cut into cells, as `cell_for` chooses them.

    Raises:
        ValueError: Cells are wider than the cup's radius, or more than `MOST_CELLS`.
    """
    vessel = Vessel(*cup, cell_for(cup, particles))
    if vessel.cell * COARSEST > cup.radius * (1.0 + 1e-6):
        least = math.ceil(particles_for(cup, cup.radius / COARSEST))
        raise ValueError(
            f"pour: {particles:g} particles make cells of {1e3 * vessel.cell:.3g} mm in a cup of "
            f"{1e3 * cup.radius:.3g} mm in radius; give particles of at least {least}, or 0"
        )
    if vessel.grid().cells > MOST_CELLS:
        fewer = int(particles or particles_for(cup, vessel.cell))
        while Vessel(*cup, cell_for(cup, fewer)).grid().cells > MOST_CELLS:
            fewer //= 2
        wanted = f"{particles:g} particles" if particles else "the cup's own cells, particles=0,"
        raise ValueError(
            f"pour: {wanted} make {vessel.grid().cells} cells of {1e3 * vessel.cell:.3g} mm, and "
            f"{MOST_CELLS} is the most; give particles of {fewer:g}, or a wider or lower cup"
        )
    return vessel


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Points of the cup's frame (n, 3) in the room's, whose origin is the lip too, once the cup has
    turned by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = points.T
    return np.stack([c * x + s * z, y, c * z - s * x], axis=1)


def _from_ring(
    out: np.ndarray, z: np.ndarray, radii: tuple[float, float], heights: tuple[float, float]
) -> np.ndarray:
    """Distance from a ring between two radii and two heights."""
    aside = np.maximum(radii[0] - out, out - radii[1])
    over = np.maximum(heights[0] - z, z - heights[1])
    at_corner = np.hypot(np.maximum(aside, 0.0), np.maximum(over, 0.0))
    return np.where((aside > 0.0) & (over > 0.0), at_corner, np.maximum(aside, over))


@cache
def _geometry(vessel: Vessel) -> Geometry:
    grid = vessel.grid()
    whole = sample_geometry(grid, vessel.distance, vessel.side, NEAREST_OF_FILMS)
    mirror = np.arange(grid.cells) // grid.strides[1] % grid.shape[1] == WALL
    for of_faces, value in ((whole.area, 0.0), (whole.carries, 0.0), (whole.shut, 1.0)):
        of_faces[1, mirror] = value
    return whole
