# type: ignore  (Taichi compiles this source and gives these names their types)
"""Flow between two plates that goes round in x and y, driven by a plate or by a body force."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import taichi as ti

from ... import runtime
from ...effect import Effect
from ...effects import EFFECTS
from ...fluid import STRIDE, Fluid, vec3
from ...liquid import Liquid
from ...numerics import Numerics

ROOM = 0.03  # of the gap beyond the particles' volume


@dataclass(frozen=True)
class Channel:
    """Plates at z = 0 and z = `layers` spacings, full of particles.

    Attributes:
        spacing: Particle spacing [m].
        layers: Particles across the gap.
        around: Particles along x and y after which the flow repeats.
        numerics: Constants of the discretisation.
    """

    spacing: float = 0.0065
    layers: int = 12
    around: int = 8
    numerics: Numerics = Numerics()

    @property
    def gap(self) -> float:
        """Distance of the plates [m], with some room: what is squeezed in flows like sand."""
        return (1.0 + ROOM) * self.layers * self.spacing


@ti.data_oriented
class ChannelScene(Fluid):
    """Fluid between plates; the upper one moves at `speed` along x, `push` acts on all."""

    def __init__(self, slots, channel, effects=()):
        particles = channel.layers * channel.around**2
        length = channel.around * channel.spacing
        extent = [(0.0, 0.0, 0.0), (length, length, channel.gap)]
        super().__init__(
            slots, particles, channel.spacing, channel.numerics, extent, (length, length)
        )
        self.bring(effects)
        self.gap, self.length = channel.gap, length
        self.speed, self.push = (ti.field(ti.f32, slots) for _ in range(2))
        self.margin = channel.numerics.contact * channel.spacing

    @ti.func
    def gravity(self, b):
        return vec3(self.push[b], 0.0, 0.0)

    @ti.func
    def boundary(self, b, i):
        up = vec3(0.0, 0.0, 1.0)
        z = self.position[b, i].z
        below = self.look_up(self.half_space, z)
        above = self.look_up(self.half_space, self.gap - z)
        self.wall[b, i] = (below[1] - above[1]) / self.h * up
        self.body_wall[b, i] = vec3(0.0)
        grip = self.wall_grip(below, up) + self.wall_grip(above, up)
        speed = ti.select(above[3] > below[3], self.speed[b], 0.0)
        self.grip_walls(b, i, grip, vec3(speed, 0.0, 0.0))
        return below[0] + above[0]

    @ti.func
    def contain(self, b):
        for i in range(self.alive[b]):
            p = self.position[b, i]
            z = ti.math.clamp(p.z, self.margin, self.gap - self.margin)
            self.velocity[b, i].z = self.velocity[b, i].z + (z - p.z) / self.dt
            x = p.x - self.length * ti.floor(p.x / self.length)
            y = p.y - self.length * ti.floor(p.y / self.length)
            self.position[b, i] = vec3(x, y, z)

    @ti.kernel
    def run(self, active: ti.i32, steps: ti.i32):
        for k in range(active * STRIDE):
            if k % STRIDE == 0:
                for _ in range(steps):
                    self.flow(k // STRIDE)


@cache
def _scene(channel: Channel, slots: int, effects: tuple[Effect, ...]) -> ChannelScene:
    runtime.start()
    return ChannelScene(slots, channel, effects)


def channel_flow(  # noqa: PLR0913  what flows, what drives it, and when to look
    channel: Channel,
    liquid: Liquid,
    speed: np.ndarray,
    push: np.ndarray,
    seconds: np.ndarray,
    start=None,
    effects: Mapping[str, np.ndarray] | None = None,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Heights and velocities of the particles after each of the times.

    Args:
        channel: Plates and discretisation.
        liquid: B liquids.
        speed: Of the upper plate along x [m/s], shape [B].
        push: Acceleration along x [m/s²], shape [B].
        seconds: Ascending times [s] at which to look, shape [T].
        start: Optional function of heights [B, particles]: velocities along x [m/s] at time 0.
        effects: Coefficients of liquid effects by name, all of which act, shape [B] each.
        seed: Of the jitter of the lattice from which the packing relaxes.

    Returns:
        z [m] and velocity along x [m/s], shape [T, B, particles] each.
    """
    size = len(speed)
    names = sorted(effects or {})
    scene = _scene(channel, max(size, 1), tuple(EFFECTS[name] for name in names))
    coefficients = np.array([(effects or {})[name] for name in names]).reshape(len(names), size)
    axis = (np.arange(channel.around) + 0.5) * channel.spacing
    height = (np.arange(channel.layers) + 0.5) / channel.layers * channel.gap
    lattice = np.stack(np.meshgrid(axis, axis, height, indexing="ij"), axis=-1).reshape(-1, 3)
    rng = np.random.default_rng(seed)
    with runtime.LOCK:
        jitter = 0.1 * channel.spacing * rng.standard_normal((size, *lattice.shape))
        scene.speed.from_numpy(np.zeros(scene.slots, np.float32))
        scene.push.from_numpy(np.zeros(scene.slots, np.float32))
        packings = scene.settled(list((lattice + jitter).astype(np.float32)), 1.0)
        scene.place([p.position for p in packings], [p.multiplier for p in packings])
        scene.pour_in(liquid.batch(size), coefficients)
        scene.speed.from_numpy(scene.padded(np.asarray(speed)))
        scene.push.from_numpy(scene.padded(np.asarray(push)))
        if start is not None:
            velocity = np.zeros((size, scene.particles, 3))
            velocity[..., 0] = start(scene.position.to_numpy()[:size, :, 2])
            scene.velocity.from_numpy(scene.padded(velocity))
        z, u, done = [], [], 0
        for until in np.rint(np.asarray(seconds) * scene.rate).astype(int):
            scene.run(size, int(until) - done)
            done = int(until)
            z.append(scene.position.to_numpy()[:size, :, 2])
            u.append(scene.velocity.to_numpy()[:size, :, 0])
    return np.array(z), np.array(u)
