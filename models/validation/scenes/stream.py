# type: ignore  (Taichi compiles this source and gives these names their types)
"""An upright rod that is held in a stream, as deep as the liquid is."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...fluid import runtime
from ...fluid.fluid import GRAVITY
from ...fluid.liquid import Liquid
from ...fluid.numerics import COARSE, ParticleNumerics
from .box import Box, box_scene, lattice

SPONGE = 0.15  # of the length: where the wake that comes round is smoothed away


@dataclass(frozen=True)
class Stream:
    """A pool over a slippery floor that repeats along x and y.

    Attributes:
        radius: Of the rod in its middle [m].
        diameters: Sides of the pool, in diameters of the rod.
        layers: Particles over the depth.
        spacing: Of particles [m].
        numerics: Constants of the discretisation.
    """

    radius: float
    diameters: float = 20.0
    layers: int = 8
    spacing: float = COARSE
    numerics: ParticleNumerics = ParticleNumerics()

    @property
    def around(self) -> int:
        """Particles along a side of the pool."""
        return round(self.diameters * 2.0 * self.radius / self.spacing)

    @property
    def side(self) -> float:
        """[m]."""
        return self.around * self.spacing

    @property
    def depth(self) -> float:
        """[m]."""
        return self.layers * self.spacing

    @property
    def box(self) -> Box:
        """Room for the pool."""
        size = (self.side, self.side, 1.5 * self.depth)
        return Box(
            size,
            self.spacing,
            self.layers * self.around**2,
            slippery=True,
            rod=self.radius,
            sponge=SPONGE * self.side,
            numerics=self.numerics,
        )

    def packing(self, seed) -> np.ndarray:
        """Particles [n, 3] beside the rod."""
        counts = (self.around, self.around, self.layers)
        points = lattice(counts, (self.side, self.side, self.depth), seed)
        off = np.hypot(*(points[:, :2] - 0.5 * self.side).T)
        return points[off > self.radius + 0.3 * self.spacing]


class Drag(NamedTuple):
    """Of each rod [B].

    Attributes:
        force: On the rod along the stream, by length of the wet rod [N/m].
        speed: Of the stream across the rod's row, the mean [m/s].
    """

    force: np.ndarray
    speed: np.ndarray


def drag(
    stream: Stream, liquid: Liquid, speed: np.ndarray, seconds: tuple[float, float], seed: int
) -> Drag:
    """Mean force between two times [s] after B streams were set in motion at `speed` [m/s]."""
    size = len(speed)
    with runtime.LOCK:
        scene = box_scene(stream.box, size)
        scene.place([stream.packing([seed, b]) for b in range(size)])
        alive = scene.alive.to_numpy()
        scene.drive()
        scene.relax_packing(size, 0.7)
        liquid = liquid.batch(size)
        scene.pour_in(liquid)
        scene.drive((0.0, 0.0, -GRAVITY), stream=speed)
        velocity = np.zeros((size, scene.particles, 3))
        velocity[..., 0] = np.asarray(speed)[:, None]
        scene.velocity.from_numpy(velocity.astype(np.float32))
        scene.advance(size, round(seconds[0] * scene.rate))
        scene.force.fill(0.0)
        steps, looks, flow = round((seconds[1] - seconds[0]) * scene.rate), 10, np.zeros(size)
        for _ in range(looks):
            scene.advance(size, steps // looks)
            flow += _mean_speed(scene, alive) / looks
        impulse = scene.force.to_numpy()[:size, 0].astype(float)
        span = (steps // looks) * looks * scene.dt
    wet = alive * stream.spacing**3 / (stream.side**2 - np.pi * stream.radius**2)
    mass = np.asarray(liquid.density) * stream.spacing**3
    return Drag(impulse * mass / span / wet, flow)


def _mean_speed(scene, alive: np.ndarray) -> np.ndarray:
    """Flux along x over the pool's cross-section [m/s], from all particles but the sponge's."""
    position, velocity = scene.positions(len(alive)), scene.velocities(len(alive))
    out = []
    for p, v, n in zip(position, velocity, alive, strict=True):
        beyond = p[:n, 0] > scene.sponge
        out.append(v[:n, 0][beyond].mean())
    return np.array(out)
