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

vec3 = ti.math.vec3
GRAVITY = 9.81
STRIDE = 512  # Taichi gives each CPU thread at least this many consecutive iterations
MEAN_NEIGHBOURS = 40  # of a half list; settled liquid has about 17
SURFACE_NORMAL = 0.4  # |n| below this is the inside of the liquid


@ti.data_oriented
class Fluid:
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
        lower, upper = np.asarray(extent, dtype=float)
        self.slots, self.particles, self.spacing = slots, particles, spacing
        self.numerics = numerics
        self.dt = 1.0 / numerics.rate
        self.h = numerics.support * spacing
        self.volume = spacing**3
        self.origin = tuple(lower)
        self.cells = tuple(int(n) for n in np.ceil((upper - lower) / self.h))
        self.capacity = MEAN_NEIGHBOURS * particles

        shape = (slots, particles)
        self.position, self.velocity, self.predicted, self.kick, self.moved, self.wall = (
            ti.Vector.field(3, ti.f32, shape) for _ in range(6)
        )
        self.normal = ti.Vector.field(3, ti.f32, shape)
        self.constraint, self.multiplier, self.surface = (ti.field(ti.f32, shape) for _ in range(3))
        self.order, self.cell = (ti.field(ti.i32, shape) for _ in range(2))
        self.cell_start = ti.field(ti.i32, (slots, int(np.prod(self.cells)) + 1))
        self.sorted = ti.Vector.field(3, ti.f32, shape)
        self.pair_start = ti.field(ti.i32, (slots, particles + 1))
        self.pair_other = ti.field(ti.i32, (slots, self.capacity))
        self.pair_gradient = ti.Vector.field(3, ti.f32, (slots, self.capacity))
        self.pair_coupling, self.pair_impulse = (
            ti.field(ti.f32, (slots, self.capacity)) for _ in range(2)
        )
        self.alive, self.overflow = (ti.field(ti.i32, slots) for _ in range(2))
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
    def cell_of(self, p):
        """Grid cell of a point; clamping keeps neighbours in neighbouring cells."""
        nx, ny, nz = ti.static(self.cells)
        q = ti.floor((p - vec3(*self.origin)) / self.h, ti.i32)
        return ti.math.clamp(q, ti.Vector([0, 0, 0]), ti.Vector([nx - 1, ny - 1, nz - 1]))

    @ti.func
    def search(self, b):
        """Half neighbour lists of the predicted positions, by counting sort."""
        nx, ny, nz = ti.static(self.cells)
        for c in range(nx * ny * nz + 1):
            self.cell_start[b, c] = 0
        for i in range(self.alive[b]):
            q = self.cell_of(self.predicted[b, i])
            c = (q[0] * ny + q[1]) * nz + q[2]
            self.cell[b, i] = c
            self.cell_start[b, c] = self.cell_start[b, c] + 1
        total = 0
        for c in range(nx * ny * nz + 1):
            total += self.cell_start[b, c]
            self.cell_start[b, c] = total
        for k in range(self.alive[b]):
            i = self.alive[b] - 1 - k
            c = self.cell[b, i]
            a = self.cell_start[b, c] - 1
            self.cell_start[b, c] = a
            self.order[b, a] = i
            self.sorted[b, a] = self.predicted[b, i]
        pairs = 0
        for a in range(self.alive[b]):
            self.pair_start[b, a] = pairs
            p = self.sorted[b, a]
            q = self.cell_of(p)
            column = (q[0] * ny + q[1]) * nz
            pairs = self.collect(
                b, p, a + 1, self.cell_start[b, column + ti.min(q[2] + 1, nz - 1) + 1], pairs
            )
            for k in ti.static(range(4)):
                dx, dy = ti.static(((0, 1), (1, -1), (1, 0), (1, 1))[k])
                if q[0] + dx < nx and 0 <= q[1] + dy and q[1] + dy < ny:
                    other = column + (dx * ny + dy) * nz
                    low = self.cell_start[b, other + ti.max(q[2] - 1, 0)]
                    high = self.cell_start[b, other + ti.min(q[2] + 1, nz - 1) + 1]
                    pairs = self.collect(b, p, low, high, pairs)
        self.pair_start[b, self.alive[b]] = pairs

    @ti.func
    def collect(self, b, p, low, high, pairs):
        """Append the sorted particles low..high-1 that lie within h of p; the new count."""
        count = pairs
        for a in range(low, high):
            d = p - self.sorted[b, a]
            if d.dot(d) < self.h * self.h:
                if count < self.capacity:
                    self.pair_other[b, count] = self.order[b, a]
                    count += 1
                else:
                    self.overflow[b] = 1
        return count

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

        Impulses accumulate, so that sweeps converge to the backward Euler step, stable for any
        viscosity; each is equal and opposite along the line of centres, so linear and angular
        momentum are kept.
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

    def padded(self, values):
        """`values` [b, ...] as float32 with zeros up to the number of slots."""
        full = np.zeros((self.slots, *values.shape[1:]), np.float32)
        full[: len(values)] = values
        return full

    def check_capacity(self):
        """
        Raises:
            RuntimeError: neighbour lists overflowed, so results are wrong.
        """
        if self.overflow.to_numpy().any():
            raise RuntimeError(
                f"a particle cluster has more than {MEAN_NEIGHBOURS} neighbours a particle; "
                "the liquid has collapsed: raise numerics.rate or lower cohesion"
            )
