# type: ignore  (Taichi compiles this source and gives these names their types)
"""Liquid over a floor: between plates, in a tank, or around an upright rod that is held fast."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import taichi as ti

from ...effect import Effect
from ...fluid import runtime, wall_tables
from ...fluid.fluid import (
    GRAVITY,
    STRIDE,
    Fluid,
    vec3,
)
from ...fluid.numerics import ParticleNumerics
from ...fluid.runtime import CHUNK

JITTER = 0.1  # sd of where particles start, in spacings


@dataclass(frozen=True)
class Box:
    """A space over z = 0 that repeats along y, and along x unless it has `ends`.

    Attributes:
        size: Lengths along x, y and z [m].
        spacing: Particle spacing [m].
        particles: Most that it holds.
        ends: Walls at both ends of x.
        lid: A plate at the top; without one `size` only says how far neighbours are searched.
        slippery: Walls take no shear.
        rod: Radius of an upright rod in the middle of x and y [m]; 0: none. To the particles it
            is as thin as a stick of that radius.
        sponge: Length at the start of x in which the liquid is brought to `stream` [m].
        numerics: Constants of the discretisation.
    """

    size: tuple[float, float, float]
    spacing: float
    particles: int
    ends: bool = False
    lid: bool = False
    slippery: bool = False
    rod: float = 0.0
    sponge: float = 0.0
    numerics: ParticleNumerics = ParticleNumerics()


@ti.data_oriented
class BoxScene(Fluid):
    """Fluid in a `Box`. `push` accelerates all of it, the lid moves along x at `lid_speed`, and
    `force` sums up the impulses on the rod, in particle masses.

    The rod acts on particles as the stick of a stirring scene does.
    """

    plain_shear = Fluid.shear

    def __init__(self, slots, box, effects=()):
        x, y, z = box.size
        period = (0.0 if box.ends else x, y)
        extent = [(0.0, 0.0, 0.0), box.size]
        super().__init__(slots, box.particles, box.spacing, box.numerics, extent, period)
        self.bring(effects)
        self.size, self.ends, self.lid, self.rod, self.sponge = (
            *(box.size, box.ends, box.lid, box.rod, box.sponge),
        )
        self.hold = 0.0 if box.slippery else 1.0
        self.margin = box.numerics.contact * box.spacing
        self.push, self.force = (ti.Vector.field(3, ti.f32, slots) for _ in range(2))
        self.lid_speed, self.stream = (ti.field(ti.f32, slots) for _ in range(2))
        self.rod_grip = ti.field(ti.f32, (slots, box.particles))
        if box.rod > 0.0:
            self.rod = box.numerics.stick_core(box.rod, box.spacing)
            self.rod_table = self.load(wall_tables.cylinder(self.rod / self.h))

    @ti.func
    def gravity(self, b):
        return self.push[b]

    @ti.func
    def from_rod(self, p):
        """Horizontal offset of p from the rod's axis [m]."""
        offset = self.apart(p, vec3(0.5 * self.size[0], 0.5 * self.size[1], 0.0))
        return vec3(offset.x, offset.y, 0.0)

    @ti.func
    def boundary(self, b, i):
        p, along, up = self.position[b, i], vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)
        floor = self.look_up(self.half_space, p.z)
        density, wall, grip = floor[0], floor[1] * up, self.wall_grip(floor, up)
        velocity = vec3(0.0)
        if ti.static(self.lid):
            lid = self.look_up(self.half_space, self.size[2] - p.z)
            density += lid[0]
            wall -= lid[1] * up
            grip += self.wall_grip(lid, up)
            velocity.x = ti.select(lid[3] > floor[3], self.lid_speed[b], 0.0)
        if ti.static(self.ends):
            near = self.look_up(self.half_space, p.x)
            far = self.look_up(self.half_space, self.size[0] - p.x)
            density += near[0] + far[0]
            wall += (near[1] - far[1]) * along
            grip += self.wall_grip(near, along) + self.wall_grip(far, along)
        grip = self.hold * grip
        self.body_wall[b, i] = vec3(0.0)
        self.rod_grip[b, i] = 0.0
        if ti.static(self.rod > 0.0):
            offset = self.from_rod(p)
            distance = ti.max(offset.norm(), 1e-6)
            rod = self.look_up(self.rod_table, distance - self.rod)
            self.body_wall[b, i] = (rod[1] / (distance * self.h)) * offset
            held = self.numerics.stick_drag * 0.5 * (rod[2] + rod[3])
            grip += held * ti.Matrix.identity(ti.f32, 3)
            share = self.share(self.kinematic(b))
            self.rod_grip[b, i] = share * held
            density += rod[0]
        self.wall[b, i] = wall / self.h
        self.grip_walls(b, i, grip, velocity)
        return density

    @ti.func
    def push_body(self, b, i, multiplier):
        self.force[b] = self.force[b] + multiplier * self.body_wall[b, i]

    @ti.func
    def shear(self, b):
        self.plain_shear(b)
        if ti.static(self.rod > 0.0):
            for i in range(self.alive[b]):
                self.force[b] = self.force[b] + self.rod_grip[b, i] * self.velocity[b, i]

    @ti.func
    def contain(self, b):
        for i in range(self.alive[b]):
            start = self.position[b, i]
            p = start
            if ti.static(self.rod > 0.0):
                offset = self.from_rod(p)
                distance = offset.norm()
                if distance < self.rod:
                    out = (self.rod - distance) / ti.max(distance, 1e-6) * offset
                    p += out
                    self.force[b] = self.force[b] - out / self.dt
            p.z = ti.max(p.z, self.margin)
            if ti.static(self.lid):
                p.z = ti.min(p.z, self.size[2] - self.margin)
            if ti.static(self.ends):
                p.x = ti.math.clamp(p.x, self.margin, self.size[0] - self.margin)
            self.velocity[b, i] = self.velocity[b, i] + (p - start) / self.dt
            if ti.static(not self.ends):
                p.x -= self.size[0] * ti.floor(p.x / self.size[0])
            p.y -= self.size[1] * ti.floor(p.y / self.size[1])
            self.position[b, i] = p
            if ti.static(self.sponge > 0.0):
                share = self.dt * self.stream[b] / (0.2 * self.sponge)
                if p.x < self.sponge:
                    wanted = vec3(self.stream[b], 0.0, self.velocity[b, i].z)
                    self.velocity[b, i] = self.velocity[b, i] + share * (
                        wanted - self.velocity[b, i]
                    )

    @ti.kernel
    def run(self, active: ti.i32, steps: ti.i32):
        for k in range(active * STRIDE):
            if k % STRIDE == 0:
                for _ in range(steps):
                    self.flow(k // STRIDE)

    def drive(self, push=(0.0, 0.0, -GRAVITY), lid_speed=0.0, stream=0.0):
        """What moves the liquid, shared or one a slot [m/s², m/s, m/s]."""
        push = np.broadcast_to(np.asarray(push, np.float32), (self.slots, 3))
        self.push.from_numpy(np.ascontiguousarray(push))
        for field, value in ((self.lid_speed, lid_speed), (self.stream, stream)):
            value = np.broadcast_to(np.asarray(value, np.float32), self.slots)
            field.from_numpy(np.ascontiguousarray(value))

    def advance(self, active, steps):
        """Substeps of the first `active` slots.

        Raises:
            RuntimeError: neighbour lists overflowed.
            TimeLimitExceeded: the time of `runtime.time_limit` is over.
        """
        for start in range(0, steps, CHUNK):
            runtime.check_time_limit(start, steps)
            self.run(active, min(CHUNK, steps - start))
        if self.fault.to_numpy()[:active].any():
            raise RuntimeError("the liquid in the box went wrong: it collapsed or ran away")

    def positions(self, active):
        """[m], shape [active, particles, 3]."""
        return self.position.to_numpy()[:active].astype(float)

    def velocities(self, active):
        """[m/s], in the order of `positions`."""
        return self.velocity.to_numpy()[:active].astype(float)


@cache
def box_scene(box: Box, slots: int, effects: tuple[Effect, ...] = ()) -> BoxScene:
    """The scene compiled for these liquid effects; to be used under `runtime.LOCK`."""
    runtime.start()
    return BoxScene(slots, box, effects)


def lattice(counts: tuple[int, int, int], size, seed: int) -> np.ndarray:
    """Points [n, 3] that fill a block at the origin of `size` [m], out of order by chance."""
    axes = [(np.arange(n) + 0.5) / n * length for n, length in zip(counts, size, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    step = (np.prod(size) / len(points)) ** (1 / 3)
    points += JITTER * step * np.random.default_rng(seed).standard_normal(points.shape)
    return np.clip(points, 0.01 * step, np.asarray(size) - 0.01 * step)
