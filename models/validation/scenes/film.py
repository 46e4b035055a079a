# type: ignore  (Taichi compiles this source and gives these names their types)
"""A layer that flows over a floor under its own weight: shear and pressure at once."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...fluid import runtime
from ...fluid.fluid import GRAVITY
from ...fluid.liquid import Liquid
from ...fluid.numerics import COARSE, ParticleNumerics
from .box import Box, box_scene, lattice

AROUND = 8  # particles along the sides, which repeat


@dataclass(frozen=True)
class Film:
    """A layer of liquid with a free surface.

    Attributes:
        layers: Particles over the depth.
        spacing: Of particles [m].
        gravity: Across the floor [m/s²].
        numerics: Constants of the discretisation.
    """

    layers: int = 10
    spacing: float = COARSE
    gravity: float = GRAVITY
    numerics: ParticleNumerics = ParticleNumerics()

    @property
    def depth(self) -> float:
        """[m]."""
        return self.layers * self.spacing

    @property
    def box(self) -> Box:
        """Room for it."""
        side = AROUND * self.spacing
        particles = self.layers * AROUND**2
        return Box((side, side, 1.5 * self.depth), self.spacing, particles, numerics=self.numerics)

    def profile(self, z: np.ndarray, speed: float) -> np.ndarray:
        """Nusselt's half parabola: velocity [m/s] at heights z, `speed` at the surface."""
        share = np.clip(z / self.depth, 0.0, 1.0)
        return speed * share * (2.0 - share)


class FilmFlow(NamedTuple):
    """Mean velocities along x [m/s] at two times, the time between them [s], and heights and
    velocities of the particles at the second, [B, particles] each."""

    first: np.ndarray
    last: np.ndarray
    seconds: float
    z: np.ndarray
    velocity: np.ndarray


def film_flow(film: Film, liquid: Liquid, speed: float, seconds: float, seed: int) -> FilmFlow:
    """Films of B liquids, each driven as its viscosity needs for `speed` [m/s] at the surface.

    They flow for a second, since packings have an order that liquids lack, and then from Nusselt's
    profile on.
    """
    size = len(np.atleast_1d(liquid.viscosity))
    liquid = liquid.batch(size)
    side = AROUND * film.spacing
    with runtime.LOCK:
        scene = box_scene(film.box, size)
        counts = (AROUND, AROUND, film.layers)
        block = (side, side, film.depth)
        scene.place([lattice(counts, block, [seed, b]) for b in range(size)])
        push = np.tile([0.0, 0.0, -film.gravity], (size, 1))
        scene.drive(push)
        scene.relax_packing(size, 1.0)
        scene.pour_in(liquid)
        push[:, 0] = 2.0 * np.asarray(liquid.viscosity) / liquid.density * speed / film.depth**2
        scene.drive(push)
        first = np.zeros(size)
        for span in (1.0, seconds):
            velocity = np.zeros((size, scene.particles, 3))
            velocity[..., 0] = film.profile(scene.positions(size)[..., 2], speed)
            first = velocity[..., 0].mean(axis=1)
            scene.velocity.from_numpy(velocity.astype(np.float32))
            scene.advance(size, round(span * scene.rate))
        z, along = scene.positions(size)[..., 2], scene.velocities(size)[..., 0]
    return FilmFlow(first, along.mean(axis=1), round(seconds * scene.rate) * scene.dt, z, along)
