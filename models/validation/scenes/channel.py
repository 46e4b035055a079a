# type: ignore  (Taichi compiles this source and gives these names their types)
"""Flow between two plates, driven by one of them or by a body force, from a profile on."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...effects import EFFECTS
from ...fluid import runtime
from ...fluid.liquid import Liquid
from ...fluid.numerics import COARSE, ParticleNumerics
from .box import Box, box_scene, lattice

ROOM = 0.03  # of the gap beyond the particles' volume: what is squeezed in flows like sand
SETTLING = 1.0  # s
SHEARED = 2.0  # s of shear at SHEAR [1/s] before time 0, as a packing's order is no liquid's
SHEAR = 1.25


@dataclass(frozen=True)
class Channel:
    """Plates that are full of particles; the flow repeats along x and y.

    Attributes:
        spacing: Particle spacing [m].
        layers: Particles across the gap.
        around: Particles along x and y.
        numerics: Constants of the discretisation.
    """

    spacing: float = COARSE
    layers: int = 12
    around: int = 8
    numerics: ParticleNumerics = ParticleNumerics()

    @property
    def gap(self) -> float:
        """Distance of the plates, at z = 0 and z = gap [m]."""
        return (1.0 + ROOM) * self.layers * self.spacing

    @property
    def box(self) -> Box:
        """The space between the plates."""
        length = self.around * self.spacing
        particles = self.layers * self.around**2
        size = (length, length, self.gap)
        return Box(size, self.spacing, particles, lid=True, numerics=self.numerics)


@dataclass(frozen=True)
class Drive:
    """What moves the liquid in each of B channels.

    Attributes:
        lid_speed: Of the upper plate along x [m/s].
        push: Acceleration of the liquid along x [m/s²].
        start: Velocity along x at time 0 [m/s] by height [m].
    """

    lid_speed: np.ndarray
    push: np.ndarray
    start: Callable[[np.ndarray], np.ndarray]


class Profiles(NamedTuple):
    """Heights [m] and velocities along x [m/s] of particles, shape [T, B, particles] each."""

    z: np.ndarray
    velocity: np.ndarray


def channel_flow(
    channel: Channel,
    liquid: Liquid,
    drive: Drive,
    seconds: Iterable[float],
    *,
    effects: Mapping[str, np.ndarray] | None = None,
    seed: int = 0,
) -> Profiles:
    """The flow after each of some ascending times [s], in B channels with a liquid each.

    Args:
        effects: Coefficients of liquid effects by name, shape [B] each; they act from time 0.
    """
    size, counts = len(drive.push), (channel.around, channel.around, channel.layers)
    names = sorted(effects or {})
    coefficients = np.array([(effects or {})[name] for name in names]).reshape(len(names), size)
    with runtime.LOCK:
        scene = box_scene(channel.box, size, tuple(EFFECTS[name] for name in names))
        seeds = [[seed, b] for b in range(size)]
        scene.place([lattice(counts, channel.box.size, one) for one in seeds])
        scene.drive(push=(0.0, 0.0, 0.0))
        scene.relax_packing(size, SETTLING)
        scene.pour_in(liquid.batch(size))
        scene.drive((0.0, 0.0, 0.0), SHEAR * channel.gap)
        scene.advance(size, round(SHEARED * scene.rate))
        # only now: so effects neither order the packing nor age while it is sheared
        scene.pour_in(liquid.batch(size), coefficients)
        push = np.zeros((size, 3))
        push[:, 0] = drive.push
        scene.drive(push, drive.lid_speed)
        velocity = np.zeros((size, scene.particles, 3))
        velocity[..., 0] = drive.start(scene.positions(size)[..., 2])
        scene.velocity.from_numpy(velocity.astype(np.float32))
        seen, done = [], 0
        for until in np.rint(np.asarray(list(seconds)) * scene.rate).astype(int):
            scene.advance(size, int(until) - done)
            done = int(until)
            seen.append((scene.positions(size)[..., 2], scene.velocities(size)[..., 0]))
    return Profiles(*(np.array(part) for part in zip(*seen, strict=True)))
