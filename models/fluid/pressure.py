# type: ignore  (Taichi compiles this source and gives these names their types)
"""Incompressibility: impulses that keep every particle's density at or below the rest density.

For each particle, C is the kernel sum of its surroundings in units of the rest density, less 1.
A substep finds multipliers p >= 0 such that

    feedback C + dt dC/dt <= 0,   p >= 0,   and one of both is zero,

where dC/dt follows from the velocities and where p acts on them along the gradient of C. With
gradients fixed at the substep's start this is a linear complementarity problem with a symmetric
matrix; projected Gauss-Seidel converges for any of those, and impulses along lines of centres
keep linear and angular momentum to rounding. Multipliers start from the last substep's, so
resting liquid needs hardly any work.

The constraint is that of Macklin & Müller 2013 ("Position Based Fluids", eq. 1), solved for
velocities, as Bender & Koschier 2015 ("Divergence-free SPH") do.
"""

import numpy as np
import taichi as ti

from . import wall_tables
from .neighbours import NeighbourSearch, vec3

LEAST_WEIGHT = 1e-3  # of 1 - r / h: closer to the edge of the support a pair has no say


@ti.data_oriented
class Pressure(NeighbourSearch):
    """Kernel sums over pairs and the multipliers of the density constraints.

    A scene overrides `boundary`, and if it holds a moving body, `body_*`.
    """

    def __init__(self, slots, particles, spacing, numerics, extent, period=(0.0, 0.0)):
        self.spacing, self.numerics = spacing, numerics
        self.h = numerics.support * spacing
        super().__init__(slots, particles, self.h, extent, period)
        self.rate = numerics.substep_rate(spacing)
        self.dt = 1.0 / self.rate
        self.volume = spacing**3
        self.norm = 21.0 / (2.0 * np.pi * self.h**3)  # of the Wendland C2 kernel
        shape, pairs = (slots, particles), (slots, self.capacity)
        self.velocity, self.wall, self.body_wall, self.pull = (
            ti.Vector.field(3, ti.f32, shape) for _ in range(4)
        )
        self.constraint, self.multiplier, self.inverse = (ti.field(ti.f32, shape) for _ in range(3))
        self.pair_x, self.pair_y, self.pair_z, self.pair_weight, self.pair_viscous = (
            ti.field(ti.f32, pairs) for _ in range(5)
        )
        self.carry(self.velocity, ti.Vector.field(3, ti.f32, shape))
        self.carry(self.multiplier, ti.field(ti.f32, shape))
        self.half_space = self.load(wall_tables.half_space())

    def load(self, table):
        """A boundary table as a field of (density, gradient, normal, tangential) rows."""
        field = ti.Vector.field(4, ti.f32, wall_tables.ENTRIES)
        field.from_numpy(np.stack(table, axis=1).astype(np.float32))
        return field

    @ti.func
    def look_up(self, table, distance):
        """Row of `table` at `distance` [m], linearly interpolated; zero beyond the support."""
        row = ti.Vector([0.0, 0.0, 0.0, 0.0])
        at = ti.math.clamp(distance / self.h, 0.0, 1.0) * (wall_tables.ENTRIES - 1)
        k = ti.cast(at, ti.i32)
        if k < wall_tables.ENTRIES - 1:
            f = at - k
            row = (1.0 - f) * table[k] + f * table[k + 1]
        return row

    @ti.func
    def boundary(self, b, i):
        """Walls at particle i: writes `wall` and `body_wall`, the gradients of what fixed walls
        and a moving body add to its density; returns what they add."""
        return 0.0

    @ti.func
    def body_softness(self, b, i):
        """How much a unit multiplier of particle i changes its own dC/dt through the body."""
        return 0.0

    @ti.func
    def body_velocity(self, b, i):
        """Velocity of the moving body where it is nearest to particle i."""
        return vec3(0.0)

    @ti.func
    def push_body(self, b, i, multiplier):
        """Give the body the reaction to particle i's multiplier."""

    @ti.func
    def gradient(self, b, k):
        """Gradient of the density that pair k contributes, at its first particle."""
        return vec3(self.pair_x[b, k], self.pair_y[b, k], self.pair_z[b, k])

    @ti.func
    def measure_pairs(self, b):
        """Gradient, density (`pair_weight`) and viscous coupling of every pair.

        First all differences, then all kernels: the second loop runs over plain arrays, and the
        compiler makes vector instructions of it.
        """
        for i in range(self.alive[b]):
            p = self.position[b, i]
            for k in range(self.pair_start[b, i], self.pair_start[b, i + 1]):
                d = self.apart(p, self.position[b, self.pair_other[b, k]])
                self.pair_x[b, k], self.pair_y[b, k], self.pair_z[b, k] = d.x, d.y, d.z
        for k in range(self.pair_start[b, self.alive[b]]):
            x, y, z = self.pair_x[b, k], self.pair_y[b, k], self.pair_z[b, k]
            squared = x * x + y * y + z * z
            r = ti.sqrt(squared) / self.h
            t = ti.max(1.0 - r, LEAST_WEIGHT)
            cubed = t * t * t
            slope = (-20.0 * self.volume * self.norm / (self.h * self.h)) * cubed
            self.pair_weight[b, k] = (self.volume * self.norm) * cubed * t * (1.0 + 4.0 * r)
            self.pair_viscous[b, k] = -1.0 / (slope * ti.max(squared, 1e-6 * self.h * self.h))
            self.pair_x[b, k], self.pair_y[b, k], self.pair_z[b, k] = (
                slope * x,
                slope * y,
                slope * z,
            )

    @ti.func
    def measure(self, b):
        """Density constraints, the diagonal of their matrix, and the last multipliers' impulses.

        `pull` becomes the sum of a particle's pair gradients.
        """
        self.measure_pairs(b)
        for i in range(self.alive[b]):
            self.multiplier[b, i] = self.numerics.memory * self.multiplier[b, i]
        for i in range(self.alive[b]):
            start, stop = self.pair_start[b, i], self.pair_start[b, i + 1]
            density, squares, x, y, z = self.volume * self.norm, 0.0, 0.0, 0.0, 0.0
            for k in range(start, stop):
                gx, gy, gz = self.pair_x[b, k], self.pair_y[b, k], self.pair_z[b, k]
                density += self.pair_weight[b, k]
                squares += gx * gx + gy * gy + gz * gz
                x += gx
                y += gy
                z += gz
            pull = vec3(x, y, z)
            own = self.multiplier[b, i]
            impulse = own * pull
            for k in range(start, stop):
                impulse += self.multiplier[b, self.pair_other[b, k]] * self.gradient(b, k)
            density += self.boundary(b, i)
            outer = self.wall[b, i] + self.body_wall[b, i]
            n = pull + outer
            self.pull[b, i] = pull
            self.constraint[b, i] = density - 1.0
            self.inverse[b, i] = 1.0 / (
                squares + n.dot(n) + self.body_softness(b, i) + 1e-6 / (self.h * self.h)
            )
            self.velocity[b, i] = self.velocity[b, i] - impulse - own * outer
            self.push_body(b, i, own)

    @ti.func
    def project(self, b, backwards):
        """One sweep of projected Gauss-Seidel over the multipliers, in either direction."""
        alive = self.alive[b]
        for n in range(alive):
            i = ti.select(backwards == 1, alive - 1 - n, n)
            v = self.velocity[b, i]
            outer = self.wall[b, i] + self.body_wall[b, i]
            rate = v.dot(self.pull[b, i] + outer) - self.body_velocity(b, i).dot(
                self.body_wall[b, i]
            )
            start, stop = self.pair_start[b, i], self.pair_start[b, i + 1]
            for k in range(start, stop):
                rate -= self.velocity[b, self.pair_other[b, k]].dot(self.gradient(b, k))
            c = self.constraint[b, i]
            # what is dense is corrected in part; what is sparse may fill up at once
            rate += ti.select(c > 0.0, self.numerics.feedback * c, c) / self.dt
            before = self.multiplier[b, i]
            after = ti.max(before + rate * self.inverse[b, i], 0.0)
            step = after - before
            if step != 0.0:
                self.multiplier[b, i] = after
                self.velocity[b, i] = v - step * (self.pull[b, i] + outer)
                for k in range(start, stop):
                    j = self.pair_other[b, k]
                    self.velocity[b, j] = self.velocity[b, j] + step * self.gradient(b, k)
                self.push_body(b, i, step)
