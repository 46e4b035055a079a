# type: ignore  (Taichi compiles this source and gives these names their types)
"""Implicit viscosity between particles, at walls and at a moving body.

Pairs exchange momentum along their line of centres by Monaghan's central form (Monaghan 2005,
"Smoothed particle hydrodynamics", eq. 8.9; factor 2 (D + 2)), which keeps linear and angular
momentum. The backward Euler step (1 + A) v' = v is solved by conjugate gradients, as Weiler et
al. 2018 ("A physically consistent implicit viscosity solver for SPH fluids") do: the matrix is
symmetric and positive, so any viscosity is stable, and every iterate keeps the momenta.
"""

import taichi as ti

from . import wall_tables
from .faults import LARGEST, UNSOLVED
from .neighbours import vec3
from .rheology import Rheology

WEAK = 0.004  # of nu dt / h^2: so thin a liquid takes one explicit step instead
MOST_ITERATIONS = 50
MOST_UNEVEN = 200  # the same where particles differ in viscosity
UNEVEN_TOLERANCE = 0.3  # of the usual one, where they do
NOTHING = 1e-20  # squared residual [m²/s²] of a solution
HOPELESS = 0.3  # of the first residual: with so much left, the velocities are no solution


@ti.data_oriented
class Viscous(Rheology):
    """A scene with walls writes `grip` and `wall_velocity` in `boundary`; one with a moving body
    adds it to the unknowns by the methods `body_*`."""

    wall_friction = 1e30  # stress by slip at walls, at most [Pa s/m]

    def __init__(self, slots, particles, spacing, numerics, extent, period=(0.0, 0.0)):
        super().__init__(slots, particles, spacing, numerics, extent, period)
        shape = (slots, particles)
        self.residual, self.search_direction, self.image, self.wall_velocity = (
            ti.Vector.field(3, ti.f32, shape) for _ in range(4)
        )
        self.grip = ti.Matrix.field(3, 3, ti.f32, shape)
        self.ease = ti.field(ti.f32, shape)
        self.pair_coupling = ti.field(ti.f32, (slots, self.capacity))
        self.cohesion, self.density = (ti.field(ti.f32, slots) for _ in range(2))
        self.unit_coupling = 10.0 * self.numerics.viscosity_gain * self.dt
        # stress by slip of all liquid near a wall together, at a share of 1 and density of 1
        nearest = self.numerics.contact / self.numerics.support
        rubbing = self.h * wall_tables.over_half_space(wall_tables.half_space().tangential, nearest)
        self.unit_friction = self.numerics.wall_slip * rubbing / self.dt

    @ti.func
    def kinematic(self, b):
        """Kinematic viscosity [m²/s] that pairs have to add for the liquid to have its own."""
        return self.kinematic_of(b, self.viscosity[b])

    @ti.func
    def kinematic_of(self, b, viscosity):
        """The same for a dynamic viscosity [Pa s]."""
        unit = self.spacing**2 / self.dt
        least = self.numerics.quiet * unit
        lacking = viscosity / self.density[b] - self.numerics.own_viscosity * unit
        return ti.max(lacking, least)

    @ti.func
    def boundary(self, b, i):
        self.wall[b, i] = vec3(0.0)
        self.body_wall[b, i] = vec3(0.0)
        self.grip_walls(b, i, ti.Matrix.zero(ti.f32, 3, 3), vec3(0.0))
        return 0.0

    @ti.func
    def wall_grip(self, row, normal):
        """Friction matrix of a wall in units of 10 nu dt / h^2, from a row of its table."""
        across = normal.outer_product(normal)
        return self.numerics.wall_normal * row[2] * across + self.wall_rub(row, normal)

    @ti.func
    def wall_rub(self, row, normal):
        """The part of `wall_grip` along the wall."""
        along = ti.Matrix.identity(ti.f32, 3) - normal.outer_product(normal)
        return self.numerics.wall_slip * row[3] * along

    @ti.func
    def share(self, kinematic):
        """10 nu dt / h^2, the unit of what couples particles to walls and bodies."""
        return self.unit_coupling * kinematic / (self.h * self.h)

    @ti.func
    def wall_share(self, b, kinematic):
        """The same at walls, on which liquid slips rather than exceed `wall_friction`."""
        most = self.wall_friction / (self.density[b] * self.unit_friction)
        return ti.min(self.share(kinematic), most)

    @ti.func
    def grip_walls(self, b, i, grip, velocity):
        """Friction of walls on particle i: a sum of `wall_grip`, and the walls' velocity."""
        share = self.wall_share(b, self.kinematic(b))
        self.grip[b, i] = share * grip
        self.ease[b, i] = 1.0 / (1.0 + share * grip.trace() / 3.0)
        self.wall_velocity[b, i] = velocity

    @ti.func
    def couple(self, b):
        """Strength of every pair's viscous coupling, in terms of its gradient."""
        scale = self.unit_coupling * self.kinematic(b)
        for k in range(self.pair_start[b, self.alive[b]]):
            self.pair_coupling[b, k] = scale * self.pair_viscous[b, k]
        if ti.static(len(self.rheology_hooks) > 0):
            self.couple_unevenly(b)

    @ti.func
    def couple_unevenly(self, b):
        """Give pairs and walls the viscosities of their particles, as of the last substep.

        Pairs take the geometric mean. In channels it errs least: with the harmonic one, which is
        for jumps, a gel's plug came out 12 % too fast, and with the arithmetic one too slow.
        """
        base = self.kinematic(b)
        self.thickest[b] = base
        if self.flows_differently(b):
            most = 0.0
            for i in range(self.alive[b]):
                own = self.kinematic_of(b, self.viscosity_of(b, i))
                most = ti.max(most, own)
                self.thickness[b, i] = own / base
            self.thickest[b] = most
            for i in range(self.alive[b]):
                own = self.thickness[b, i]
                share = self.wall_share(b, own * base) / self.wall_share(b, base)
                self.grip[b, i] = share * self.grip[b, i]
                self.body_thicken(b, i, own)
                diagonal = self.grip[b, i].trace()
                for k in range(self.pair_start[b, i], self.pair_start[b, i + 1]):
                    other = self.thickness[b, self.pair_other[b, k]]
                    mean = ti.sqrt(own * other)
                    coupling = mean * self.pair_coupling[b, k]
                    self.pair_coupling[b, k] = coupling
                    g = self.gradient(b, k)
                    diagonal += coupling * g.dot(g)
                self.ease[b, i] = 1.0 / (1.0 + diagonal / 3.0)

    @ti.func
    def apply(self, b, walls_move):
        """`image` = (1 + A) `search_direction`; less what moving walls give, if they do."""
        for i in range(self.alive[b]):
            p = self.search_direction[b, i]
            even, odd = self.grip[b, i] @ (p - walls_move * self.wall_velocity[b, i]), vec3(0.0)
            k, stop = self.pair_start[b, i], self.pair_start[b, i + 1]
            while k + 1 < stop:  # two sums, since one waits for its own last addition
                even += self.coupled(b, k, p)
                odd += self.coupled(b, k + 1, p)
                k += 2
            if k < stop:
                even += self.coupled(b, k, p)
            self.image[b, i] = p + even + odd
        self.body_apply(b, walls_move)

    @ti.func
    def coupled(self, b, k, p):
        """Part of A p at a particle of search direction p, from its pair k."""
        g = self.gradient(b, k)
        other = self.search_direction[b, self.pair_other[b, k]]
        return (self.pair_coupling[b, k] * (p - other).dot(g)) * g

    @ti.func
    def shear(self, b):
        """The viscous substep of the velocities."""
        alive = self.alive[b]
        for i in range(alive):
            self.search_direction[b, i] = self.velocity[b, i]
        self.body_load(b)
        self.apply(b, 1.0)
        size = 0.0
        for i in range(alive):
            r = self.velocity[b, i] - self.image[b, i]
            self.residual[b, i] = r
            self.search_direction[b, i] = self.ease[b, i] * r
            size += self.ease[b, i] * r.dot(r)
        size += self.body_residual(b)
        if not size < LARGEST:
            self.fault[b] = UNSOLVED
        thickest = self.kinematic(b)
        if ti.static(len(self.rheology_hooks) > 0):
            thickest = self.thickest[b]
        if thickest * self.dt < WEAK * self.h * self.h:
            for i in range(alive):
                self.velocity[b, i] = self.velocity[b, i] + self.search_direction[b, i]
            self.body_step(b, 1.0)
        else:
            self.iterate(b, size)

    @ti.func
    def iterate(self, b, size):
        """Conjugate gradients from the velocities, whose squared residual is `size`."""
        alive = self.alive[b]
        enough = self.numerics.viscous_tolerance**2 * size
        if ti.static(len(self.rheology_hooks) > 0):
            if self.flows_differently(b):
                enough *= UNEVEN_TOLERANCE**2
        left, count = size, 0
        most = ti.static(MOST_UNEVEN if len(self.rheology_hooks) > 0 else MOST_ITERATIONS)
        while count < most and left > enough and left > NOTHING:
            count += 1
            self.apply(b, 0.0)
            curvature = self.body_curvature(b)
            for i in range(alive):
                curvature += self.search_direction[b, i].dot(self.image[b, i])
            step = left / curvature
            new = self.body_step(b, step)
            for i in range(alive):
                self.velocity[b, i] = self.velocity[b, i] + step * self.search_direction[b, i]
                r = self.residual[b, i] - step * self.image[b, i]
                self.residual[b, i] = r
                new += self.ease[b, i] * r.dot(r)
            for i in range(alive):
                self.search_direction[b, i] = (
                    self.ease[b, i] * self.residual[b, i]
                    + (new / left) * self.search_direction[b, i]
                )
            self.body_turn(b, new / left)
            left = new
        if not left <= ti.max(HOPELESS**2 * size, NOTHING):  # nor where it is NaN
            self.fault[b] = UNSOLVED

    @ti.func
    def body_thicken(self, b, i, ratio):
        """Multiply the body's viscous coupling to particle i by `ratio`."""

    @ti.func
    def body_load(self, b):
        """Put the body's velocity into its search direction."""

    @ti.func
    def body_apply(self, b, moves):
        """Add the body's coupling to the images; its imposed motion counts if it `moves`."""

    @ti.func
    def body_residual(self, b):
        """Residual and first search direction of the body; its squared size."""
        return 0.0

    @ti.func
    def body_curvature(self, b):
        """The body's part of search direction times image."""
        return 0.0

    @ti.func
    def body_step(self, b, step):
        """Move the body's velocity along its search direction; its new squared residual."""
        return 0.0

    @ti.func
    def body_turn(self, b, share):
        """The body's next search direction."""
