# type: ignore  (Taichi compiles this source and gives these names their types)
"""The stirring scene: liquid in a cup, a stick hung from the gripper as a spherical pendulum."""

import numpy as np
import taichi as ti

from . import tables
from .fluid import GRAVITY, STRIDE, Fluid, vec3


@ti.data_oriented
class StirringScene(Fluid):
    """Fluid, cup and stick of a batch of stirring trials."""

    def __init__(self, slots, setup, particles=None):
        """
        Args:
            slots: Trials that run side by side.
            setup: `StirSetup`.
            particles: Most particles that a trial may hold; None: the setup's.
        """
        particles = setup.particles if particles is None else particles
        cup, stick = setup.cup, setup.stick
        top = 1.5 * cup.fill
        extent = [(-cup.radius, -cup.radius, 0.0), (cup.radius, cup.radius, top)]
        super().__init__(slots, particles, setup.spacing, setup.numerics, extent)
        self.cup_radius = cup.radius
        self.margin = setup.numerics.contact * setup.spacing
        self.stick_radius, self.stick_length = stick.radius, stick.length
        # a capsule of the stick's volume: its round end reaches as far as the flat one on average
        self.stick_end = stick.length - 2.0 * stick.radius / 3.0
        self.stick_gyration = stick.gyration
        self.stick_table = self.load(tables.cylinder(stick.radius / self.h))
        self.pivot, self.pivot_velocity, self.direction, self.swing, self.torque = (
            ti.Vector.field(3, ti.f32, slots) for _ in range(5)
        )
        self.stick_wall = ti.Vector.field(3, ti.f32, (slots, particles))
        self.stick_mass, self.stick_inertia, self.pivot_friction = (
            ti.field(ti.f32, slots) for _ in range(3)
        )
        self.fit_stick(np.full(slots, stick.mass), np.zeros(slots))

    @ti.func
    def from_stick(self, b, p):
        """Offset of p from the stick's axis and the lever of the nearest point on it [m]."""
        arm = p - self.pivot[b]
        lever = ti.math.clamp(arm.dot(self.direction[b]), 0.0, self.stick_end)
        return arm - lever * self.direction[b], lever

    @ti.func
    def boundary(self, b, i):
        p = self.predicted[b, i]
        radial = vec3(p.x, p.y, 0.0)
        reach = ti.max(radial.norm(), 1e-6)
        side = self.look_up(self.half_space, self.cup_radius - reach)
        floor = self.look_up(self.half_space, p.z)
        self.wall[b, i] = (-side[1] / (reach * self.h)) * radial + vec3(0.0, 0.0, floor[1] / self.h)
        offset, lever = self.from_stick(b, p)
        distance = ti.max(offset.norm(), 1e-6)
        stick = self.look_up(self.stick_table, distance - self.stick_radius)
        self.stick_wall[b, i] = (stick[1] / (distance * self.h)) * offset
        self.wall[b, i] = self.wall[b, i] + self.stick_wall[b, i]
        return side[0] + floor[0] + stick[0]

    @ti.func
    def contain(self, b):
        """Keep particles in the cup and off the stick; the stick takes what it gave."""
        mass = self.density[b] * self.volume
        limit = self.cup_radius - self.margin
        for i in range(self.alive[b]):
            push = self.multiplier[b, i] * self.stick_wall[b, i]
            p = self.predicted[b, i]
            offset, lever = self.from_stick(b, p)
            distance = offset.norm()
            if distance < self.stick_radius:
                out = (self.stick_radius - distance) / ti.max(distance, 1e-6) * offset
                push += out
                p += out
            self.torque[b] = self.torque[b] - (mass * lever / self.dt) * push
            radial = vec3(p.x, p.y, 0.0)
            reach = radial.norm()
            if reach > limit:
                p -= (1.0 - limit / reach) * radial
            p.z = ti.max(p.z, self.margin)
            self.predicted[b, i] = p

    @ti.func
    def drag(self, b):
        """Friction of cup and stick, one sweep's share; the stick takes the reaction."""
        share = self.wall_share(b)
        mass = self.density[b] * self.volume
        for i in range(self.alive[b]):
            p, v = self.position[b, i], self.velocity[b, i]
            radial = vec3(p.x, p.y, 0.0)
            reach = ti.max(radial.norm(), 1e-6)
            if self.cup_radius - reach < self.h:
                side = self.look_up(self.half_space, self.cup_radius - reach)
                v = self.rub(v, radial / reach, side, share)
            if p.z < self.h:
                v = self.rub(v, vec3(0.0, 0.0, -1.0), self.look_up(self.half_space, p.z), share)
            offset, lever = self.from_stick(b, p)
            distance = offset.norm()
            if distance < self.stick_radius + self.h:
                stick = self.look_up(self.stick_table, distance - self.stick_radius)
                q = share * self.numerics.stick_drag * 0.5 * (stick[2] + stick[3])
                u = self.direction[b]
                slide = v - self.pivot_velocity[b] - lever * self.swing[b]
                along = slide.dot(u) * u
                # implicit in both partners: the stick yields by its inertia about the pivot
                yielding = mass * lever * lever / self.stick_inertia[b]
                impulse = -q / (1.0 + q * (1.0 + yielding)) * (slide - along)
                v += impulse - q / (1.0 + q) * along
                self.swing[b] = self.swing[b] - (mass * lever / self.stick_inertia[b]) * impulse
            self.velocity[b, i] = v

    @ti.func
    def swing_stick(self, b, pivot):
        """Move the pendulum one substep: gravity and the pivot's acceleration about the pivot."""
        velocity = (pivot - self.pivot[b]) / self.dt
        jolt = velocity - self.pivot_velocity[b]
        self.pivot[b], self.pivot_velocity[b] = pivot, velocity
        arm = 0.5 * self.stick_mass[b] * self.stick_length / self.stick_inertia[b]
        swing = self.swing[b] + arm * (vec3(0.0, 0.0, -GRAVITY * self.dt) - jolt)
        u = self.direction[b]
        swing = self.rub_pivot(b, swing - swing.dot(u) * u)
        u = (u + self.dt * swing).normalized()
        self.direction[b] = u
        self.swing[b] = swing - swing.dot(u) * u
        self.torque[b] = vec3(0.0)

    @ti.func
    def rub_pivot(self, b, swing):
        """The swing after dry friction: less by the pivot's torque for a substep, or none at all.

        `swing` holds every other impulse since the last call, so a stick that they cannot turn
        stays where it is.
        """
        loss = self.dt * self.pivot_friction[b] / self.stick_inertia[b]
        rubbed = swing
        if loss > 0.0:
            rubbed = ti.max(1.0 - loss / ti.max(swing.norm(), 1e-12), 0.0) * swing
        return rubbed

    @ti.func
    def react(self, b):
        """Give the stick the liquid's pressure of this substep."""
        u = self.direction[b]
        t = self.torque[b] / self.stick_inertia[b]
        self.swing[b] = self.swing[b] + t - t.dot(u) * u

    @ti.kernel
    def stir(
        self,
        active: ti.i32,
        start: ti.i32,
        stop: ti.i32,
        path: ti.types.ndarray(dtype=ti.math.vec3, ndim=2),
        directions: ti.types.ndarray(dtype=ti.math.vec3, ndim=2),
    ):
        """Substeps start..stop-1 of the first `active` trials.

        Args:
            path: Pivot at the end of each substep [m], shape [active, substeps].
            directions: Out: unit vector from pivot to tip at the same times.
        """
        for k in range(active * STRIDE):
            if k % STRIDE == 0:
                b = k // STRIDE
                for n in range(start, stop):
                    self.swing_stick(b, path[b, n])
                    self.flow(b)
                    self.react(b)
                    self.relax(b)
                    directions[b, n] = self.direction[b]

    def place(self, packings):
        """Put packings, each [n, 3] with n <= `particles`, at rest into the first slots."""
        positions = np.zeros((len(packings), self.particles, 3), np.float32)
        alive = np.zeros(self.slots, np.int32)
        for b, packing in enumerate(packings):
            positions[b, : len(packing)] = packing
            alive[b] = len(packing)
        super().place(positions)
        self.alive.from_numpy(alive)

    def fit_stick(self, mass, pivot_friction):
        """Mass [kg] and pivot's friction torque [N m] of the first sticks, each [b]."""
        self.stick_mass.from_numpy(self.padded(mass))
        self.stick_inertia.from_numpy(self.padded(mass * self.stick_gyration))
        self.pivot_friction.from_numpy(self.padded(pivot_friction))

    def place_stick(self, pivots):
        """Hang the sticks straight down from `pivots` [b, 3], at rest."""
        self.pivot.from_numpy(self.padded(pivots))
        self.pivot_velocity.fill(0.0)
        self.swing.fill(0.0)
        self.direction.from_numpy(np.tile(np.float32([0.0, 0.0, -1.0]), (self.slots, 1)))
