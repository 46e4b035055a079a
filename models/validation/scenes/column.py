# type: ignore  (Taichi compiles this source and gives these names their types)
"""Liquid that settles under gravity on a floor."""

from dataclasses import dataclass

import numpy as np

from ...fluid import runtime
from ...fluid.liquid import Liquid
from ...fluid.numerics import ParticleNumerics
from .box import Box, box_scene, lattice

AROUND = 8  # spacings along a side that repeats
SETTLING = 1.5  # s


@dataclass(frozen=True)
class Column:
    """A block of liquid.

    Attributes:
        width: Along x [m].
        height: Depth of the liquid [m].
        layers: Particles over the height.
        numerics: Constants of the discretisation.
    """

    width: float
    height: float
    layers: int
    numerics: ParticleNumerics = ParticleNumerics()

    @property
    def spacing(self) -> float:
        """Of the particles [m]."""
        return self.height / self.layers

    @property
    def counts(self) -> tuple[int, int, int]:
        """Particles along x, y and z."""
        return (round(self.width / self.spacing), AROUND, self.layers)

    @property
    def box(self) -> Box:
        """A space around it that repeats along x and y."""
        size = (self.width, AROUND * self.spacing, 1.5 * self.height)
        return Box(size, self.spacing, int(np.prod(self.counts)), numerics=self.numerics)

    @property
    def block(self) -> tuple[float, float, float]:
        """Where its particles start, with the room that they have at rest [m]."""
        return (self.width, AROUND * self.spacing, self.height)


def at_rest(
    column: Column, liquid: Liquid, seconds: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and velocities [m/s], [B, particles, 3], of columns that stand on a floor.

    They settle first, then each liquid is left to itself for `seconds`.
    """
    size = len(np.atleast_1d(liquid.viscosity))
    with runtime.LOCK:
        scene = box_scene(column.box, size)
        scene.place([lattice(column.counts, column.block, [seed, b]) for b in range(size)])
        scene.drive()
        scene.relax_packing(size, SETTLING)
        scene.pour_in(liquid.batch(size))
        scene.advance(size, round(seconds * scene.rate))
        return scene.positions(size), scene.velocities(size)
