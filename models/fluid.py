# type: ignore  (Taichi compiles this source and gives these names their types)
"""A batch of particle liquids: position-based fluid with pairwise viscosity and cohesion.

Position-based fluid after Macklin & Müller 2013 ("Position Based Fluids", equations 1 to 12),
with the Wendland C2 kernel for density and gradient alike, walls as tables (`tables`), implicit
pairwise viscosity and a surface attraction. One thread runs one simulation from end to end, in
a fixed order, so a simulation's bits depend neither on the batch nor on the number of threads.
"""

import numpy as np
import taichi as ti

from . import tables
from .liquid import Liquid
from .neighbours import NeighbourSearch

vec3 = ti.math.vec3
GRAVITY = 9.81
STRIDE = 512  # Taichi gives each CPU thread at least this many consecutive iterations
SETTLING_LIQUID = Liquid(viscosity=0.05, cohesion=0.0, density=1000.0)
DAMPING = 0.97  # of velocities each substep while a packing settles
SURFACE_NORMAL = 0.4  # |n| below this is the inside of the liquid


@ti.data_oriented
class Fluid(NeighbourSearch):
    """State and steps of up to `slots` liquids of at most `particles` each.

    A scene is a subclass that overrides `boundary`, `contain` and `drag`, and whose kernels run
    `flow` and `relax`. The first `alive[b]` particles of simulation b take part.
    """

    def __init__(self, slots, particles, spacing, numerics, extent):
        """
        Args:
            slots: Simulations that run side by side.
            particles: Particles a simulation.
            spacing: Particle spacing d [m]; a particle's volume is d³.
            numerics: `Numerics`.
            extent: Lower and upper corner of the search grid [m]; particles may leave it.
        """
        h = numerics.support * spacing
        super().__init__(slots, particles, h, extent)
        self.spacing, self.numerics, self.h = spacing, numerics, h
        self.dt = 1.0 / numerics.rate
        self.volume = spacing**3

        shape, pairs = (slots, particles), (slots, self.capacity)
        self.position, self.velocity, self.kick, self.moved, self.wall, self.normal = (
            ti.Vector.field(3, ti.f32, shape) for _ in range(6)
        )
        self.constraint, self.multiplier, self.surface = (ti.field(ti.f32, shape) for _ in range(3))
        self.pair_gradient = ti.Vector.field(3, ti.f32, pairs)
        self.pair_coupling, self.pair_impulse = (ti.field(ti.f32, pairs) for _ in range(2))
        self.viscosity, self.cohesion, self.density = (ti.field(ti.f32, slots) for _ in range(3))
        self.half_space = self.load(tables.half_space())

    def load(self, table):
        """A boundary table as a field of (density, gradient, normal, tangential) rows."""
        field = ti.Vector.field(4, ti.f32, tables.ENTRIES)
        field.from_numpy(np.stack(table, axis=1).astype(np.float32))
        return field

    @ti.func
    def look_up(self, table, distance):
        """Row of `table` at `distance` [m], linearly interpolated; zero beyond the support."""
        row = ti.Vector([0.0, 0.0, 0.0, 0.0])
        at = ti.max(distance / self.h, 0.0) * (tables.ENTRIES - 1)
        k = ti.cast(at, ti.i32)
        if k < tables.ENTRIES - 1:
            f = at - k
            row = (1.0 - f) * table[k] + f * table[k + 1]
        return row

    @ti.func
    def predict(self, b):
        """Positions after gravity and the last step's attraction, before pressure."""
        gravity = vec3(0.0, 0.0, -GRAVITY)
        for i in range(self.alive[b]):
            v = self.velocity[b, i] + self.dt * gravity + self.kick[b, i]
            self.kick[b, i] = vec3(0.0)
            self.predicted[b, i] = self.position[b, i] + self.dt * v

    @ti.func
    def boundary(self, b, i):
        """Walls at particle i: writes `wall`, the density gradient; returns their density."""
        self.wall[b, i] = vec3(0.0)
        return 0.0

    @ti.func
    def contain(self, b):
        """Push predicted positions out of walls."""

    @ti.func
    def drag(self, b):
        """Friction of walls on velocities, one sweep's share."""

    @ti.func
    def rub(self, v, outward, row, share):
        """Velocity relative to a wall after its friction; `row` of the wall's table."""
        vn = v.dot(outward) * outward
        slide = (v - vn) / (1.0 + share * self.numerics.wall_slip * row[3])
        return slide + vn / (1.0 + share * self.numerics.wall_normal * row[2])

    @ti.func
    def wall_share(self, b):
        """Viscous coupling to a wall of table value 1, for one sweep."""
        kinematic = self.viscosity[b] / self.density[b]
        return 10.0 * kinematic * self.dt / (self.numerics.sweeps * self.h * self.h)

    @ti.func
    def solve_multipliers(self, b):
        """Density constraints and their multipliers (equations 1, 8 and 11)."""
        h = self.h
        norm = 21.0 / (2.0 * ti.math.pi * h**3)
        for i in range(self.alive[b]):
            self.constraint[b, i] = self.volume * norm - 1.0 + self.boundary(b, i)
            self.normal[b, i] = self.wall[b, i]
            self.multiplier[b, i] = 0.0
        for a in range(self.alive[b]):
            i = self.order[b, a]
            p = self.predicted[b, i]
            constraint, squares, gradient = 0.0, 0.0, vec3(0.0)
            for k in range(self.pair_start[b, a], self.pair_start[b, a + 1]):
                j = self.pair_other[b, k]
                d = p - self.predicted[b, j]
                r = ti.sqrt(d.dot(d)) / h
                t = ti.max(1.0 - r, 0.0)
                t3 = t * t * t
                w = self.volume * norm * t3 * t * (1.0 + 4.0 * r)
                g = (-20.0 * self.volume * norm / (h * h)) * t3 * d
                square = g.dot(g)
                self.pair_gradient[b, k] = g
                constraint += w
                gradient += g
                squares += square
                self.constraint[b, j] = self.constraint[b, j] + w
                self.normal[b, j] = self.normal[b, j] - g
                self.multiplier[b, j] = self.multiplier[b, j] + square
            self.constraint[b, i] = self.constraint[b, i] + constraint
            self.normal[b, i] = self.normal[b, i] + gradient
            self.multiplier[b, i] = self.multiplier[b, i] + squares
        for i in range(self.alive[b]):
            n = self.normal[b, i]
            squares = self.multiplier[b, i] + n.dot(n) + self.numerics.compliance / (h * h)
            self.multiplier[b, i] = -ti.max(self.constraint[b, i], 0.0) / squares

    @ti.func
    def correct(self, b):
        """Move the predicted positions along the constraints (equation 12); `moved` by pairs."""
        for i in range(self.alive[b]):
            self.moved[b, i] = self.multiplier[b, i] * self.wall[b, i]
        for a in range(self.alive[b]):
            i = self.order[b, a]
            own = self.multiplier[b, i]
            moved = vec3(0.0)
            for k in range(self.pair_start[b, a], self.pair_start[b, a + 1]):
                j = self.pair_other[b, k]
                step = (own + self.multiplier[b, j]) * self.pair_gradient[b, k]
                moved += step
                self.moved[b, j] = self.moved[b, j] - step
            self.moved[b, i] = self.moved[b, i] + moved
        for i in range(self.alive[b]):
            self.predicted[b, i] = self.predicted[b, i] + self.moved[b, i]

    @ti.func
    def advance(self, b):
        """Accept the predicted positions; velocities follow from them."""
        for i in range(self.alive[b]):
            self.velocity[b, i] = (self.predicted[b, i] - self.position[b, i]) / self.dt
            self.position[b, i] = self.predicted[b, i]

    @ti.func
    def find_surface(self, b):
        """Weight in [0, 1] of each particle's share in the surface attraction."""
        for i in range(self.alive[b]):
            bend = (self.h * self.normal[b, i].norm() - SURFACE_NORMAL) / SURFACE_NORMAL
            sparse = (-self.constraint[b, i] - 0.05) / 0.3
            self.surface[b, i] = ti.math.clamp(ti.max(bend, sparse), 0.0, 1.0)

    @ti.func
    def couple(self, b):
        """Strength of each pair's viscous coupling, and its attraction as the next kick.

        The viscosity is Monaghan's central form (Monaghan 2005, equation 8.9; factor 2 (D + 2)).
        The attraction acts between surface particles only and is damped along the pair, since
        an undamped one heats the liquid.
        """
        h = self.h
        norm = 21.0 / (2.0 * ti.math.pi * h**3)
        viscous = 10.0 * self.viscosity[b] / self.density[b] * self.volume * norm * 20.0 / (h * h)
        pull = self.cohesion[b] * self.numerics.attraction
        for a in range(self.alive[b]):
            i = self.order[b, a]
            p = self.position[b, i]
            kick = vec3(0.0)
            for k in range(self.pair_start[b, a], self.pair_start[b, a + 1]):
                j = self.pair_other[b, k]
                d = p - self.position[b, j]
                distance = ti.max(ti.sqrt(d.dot(d)), 1e-3 * h)
                e = d / distance
                r = distance / h
                t = ti.max(1.0 - r, 0.0)
                weight = 0.5 * pull * (self.surface[b, i] + self.surface[b, j])
                damping = 0.3 * ti.sqrt(2.0 * weight / h) * 64.0 * (r * t) ** 3
                self.pair_coupling[b, k] = self.dt * (viscous * t * t * t + damping)
                self.pair_impulse[b, k] = 0.0
                self.pair_gradient[b, k] = e
                step = self.dt * weight * 9.48 * r * t * t * t * e
                kick -= step
                self.kick[b, j] = self.kick[b, j] + step
            self.kick[b, i] = self.kick[b, i] + kick

    @ti.func
    def exchange(self, b):
        """One Gauss-Seidel sweep of the implicit viscosity over all pairs.

        Impulses accumulate, so that many sweeps converge to the backward Euler step, and any
        number of them is stable. The few of `Numerics` fall short of it in stiff liquids. Each
        impulse is equal and opposite along the line of centres, so linear and angular momentum
        are kept.
        """
        for a in range(self.alive[b]):
            i = self.order[b, a]
            v = self.velocity[b, i]
            for k in range(self.pair_start[b, a], self.pair_start[b, a + 1]):
                j = self.pair_other[b, k]
                e = self.pair_gradient[b, k]
                q = self.pair_coupling[b, k]
                approach = (v - self.velocity[b, j]).dot(e)
                impulse = -(q * approach + self.pair_impulse[b, k]) / (1.0 + 2.0 * q)
                self.pair_impulse[b, k] = self.pair_impulse[b, k] + impulse
                v += impulse * e
                self.velocity[b, j] = self.velocity[b, j] - impulse * e
            self.velocity[b, i] = v

    @ti.func
    def flow(self, b):
        """One substep of the liquid without its viscosity."""
        self.predict(b)
        self.search(b)
        for _ in range(self.numerics.iterations):
            self.solve_multipliers(b)
            self.correct(b)
            self.contain(b)
        self.advance(b)
        self.find_surface(b)
        self.couple(b)

    @ti.func
    def relax(self, b):
        """Viscosity within the liquid and against walls."""
        for _s in range(self.numerics.sweeps):
            self.exchange(b)
            self.drag(b)

    @ti.kernel
    def settle(self, active: ti.i32, steps: ti.i32, damping: ti.f32):
        """Let the first `active` packings relax, velocities times `damping` each substep."""
        for n in range(active * STRIDE):
            if n % STRIDE == 0:
                b = n // STRIDE
                for _n in range(steps):
                    self.flow(b)
                    self.relax(b)
                    for i in range(self.alive[b]):
                        self.velocity[b, i] = damping * self.velocity[b, i]

    def place(self, positions):
        """Put `positions` [b, particles, 3] at rest into the first slots."""
        self.position.from_numpy(self.padded(positions))
        self.velocity.fill(0.0)
        self.kick.fill(0.0)
        self.alive.fill(self.particles)
        self.overflow.fill(0)

    def pour_in(self, liquid):
        """Set what liquid each slot holds, from a batched `Liquid`."""
        self.viscosity.from_numpy(self.padded(liquid.viscosity))
        self.cohesion.from_numpy(self.padded(liquid.cohesion))
        self.density.from_numpy(self.padded(liquid.density))

    def relax_packing(self, active, seconds):
        """Let the first `active` packings come to rest, the same for every liquid."""
        self.pour_in(SETTLING_LIQUID.batch(active))
        self.settle(active, round(seconds * self.numerics.rate), DAMPING)

    def diverged(self, active):
        """Which of the first `active` liquids hold a particle that is nowhere, bool [active]."""
        return ~np.isfinite(self.position.to_numpy()[:active]).all(axis=(1, 2))

    def padded(self, values):
        """`values` [b, ...] as float32 with zeros up to the number of slots."""
        full = np.zeros((self.slots, *values.shape[1:]), np.float32)
        full[: len(values)] = values
        return full
