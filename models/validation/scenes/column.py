# type: ignore  (Taichi compiles this source and gives these names their types)
"""Liquid that settles under gravity: at rest on a floor, or let go beside one wall of a tank."""

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

    def box(self, length: float) -> Box:
        """A space around it, repeating along y: a tank of `length` [m] along x; 0: repeats."""
        size = (length or self.width, AROUND * self.spacing, 1.5 * self.height)
        particles = int(np.prod(self.counts))
        return Box(size, self.spacing, particles, ends=length > 0, numerics=self.numerics)

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
        scene = box_scene(column.box(0.0), size)
        scene.place([lattice(column.counts, column.block, [seed, b]) for b in range(size)])
        scene.drive()
        scene.relax_packing(size, SETTLING)
        scene.pour_in(liquid.batch(size))
        scene.advance(size, round(seconds * scene.rate))
        return scene.positions(size), scene.velocities(size)


def collapse(
    column: Column, liquid: Liquid, length: float, seconds: float, seeds: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    """A column at x = 0 that nothing holds any more, in a tank of `length` [m].

    It settles between walls `column.width` apart; then the far one is gone at once.

    Returns:
        Times [s], shape [T], the first 0, and positions [m], shape [T, B, particles, 3].
    """
    size = len(seeds)
    with runtime.LOCK:
        held = box_scene(column.box(column.width), size)
        held.place([lattice(column.counts, column.block, seed) for seed in seeds])
        held.drive()
        held.relax_packing(size, SETTLING)
        start = held.positions(size)
        scene = box_scene(column.box(length), size)
        scene.place(list(start))
        scene.multiplier.from_numpy(held.multiplier.to_numpy())
        scene.drive()
        scene.pour_in(liquid.batch(size))
        every = max(1, round(scene.rate * 0.005))
        looks = round(seconds * scene.rate / every)
        seen = [start]
        for _ in range(looks):
            scene.advance(size, every)
            seen.append(scene.positions(size))
    return np.arange(looks + 1) * every / scene.rate, np.array(seen)
