# type: ignore  (Taichi compiles this source and gives these names their types)
"""The stirring scene: liquid in a cup, a stick hung from the gripper as a spherical pendulum.

The stick is about one particle wide. Particles keep off it by a part of their spacing, so at its
own radius it drags like a thicker one; to them it is as thin as makes the drag right (validation
case `cylinder_drag`). What it displaces beyond that core acts on it by closed forms: Archimedes'
lift, whose reaction all liquid bears like that of a risen surface, and the added mass of a
cylinder in potential flow, which is what it displaces (Lamb 1932, "Hydrodynamics", art. 68), as
in liquid that does not itself accelerate. So vertical momentum balances between stick and liquid,
but the angular one only up to these two.
"""

import numpy as np
import taichi as ti

from . import tables
from .faults import SOUND
from .fluid import GRAVITY, STRIDE, Fluid, vec3


@ti.data_oriented
class StirringScene(Fluid):
    """Fluid, cup and stick of a batch of stirring trials.

    The stick is the moving body: `swing` is the rate of change of its direction [1/s]. In the
    viscous solve its unknown is `swing` times the root of inertia over a particle's mass, which
    makes the matrix symmetric.
    """

    walls = 2

    def __init__(self, slots, setup, particles=None, effects=()):
        """
        Args:
            slots: Trials that run side by side.
            setup: `StirSetup`.
            particles: Most particles that a trial may hold; None: the setup's.
            effects: Liquid effects to compile for.
        """
        particles = setup.particles if particles is None else particles
        cup, stick = setup.cup, setup.stick
        top = 1.5 * cup.fill
        extent = [(-cup.radius, -cup.radius, 0.0), (cup.radius, cup.radius, top)]
        super().__init__(slots, particles, setup.spacing, setup.numerics, extent)
        self.bring(effects)
        self.cup_radius = cup.radius
        self.margin = setup.numerics.contact * setup.spacing
        self.core = setup.numerics.stick_core(stick.radius, setup.spacing)
        self.stick_length = stick.length
        # a capsule of the stick's volume: its round end reaches as far as the flat one on average
        self.stick_end = stick.length - 2.0 * stick.radius / 3.0
        self.stick_gyration = stick.gyration
        table = tables.cylinder(self.core / self.h)
        self.stick_table = self.load(table)
        hidden = np.pi * (stick.radius**2 - self.core**2)  # [m²]
        around = self.h**2 * tables.around_cylinder(table.density, self.core / self.h)
        self.hidden_share = hidden / around  # of a particle's volume, where the table is 1
        self.pivot, self.pivot_velocity, self.direction, self.swing = (
            ti.Vector.field(3, ti.f32, slots) for _ in range(4)
        )
        self.stick_residual, self.stick_search, self.stick_image = (
            ti.Vector.field(3, ti.f32, slots) for _ in range(3)
        )
        # volume that the core does not displace, and its first and second moment about the pivot
        self.hidden, self.hidden_sum = (ti.Vector.field(3, ti.f32, slots) for _ in range(2))
        self.lever, self.stick_grip = (ti.field(ti.f32, (slots, particles)) for _ in range(2))
        self.stick_mass, self.stick_inertia, self.pivot_friction, self.free = (
            ti.field(ti.f32, slots) for _ in range(4)
        )
        self.fit_stick(np.full(slots, stick.mass), np.zeros(slots))
        self.free.fill(1.0)

    @ti.func
    def from_stick(self, b, p):
        """Offset of p from the stick's axis and the lever of the nearest point on it [m]."""
        arm = p - self.pivot[b]
        lever = ti.math.clamp(arm.dot(self.direction[b]), 0.0, self.stick_end)
        return arm - lever * self.direction[b], lever

    @ti.func
    def boundary(self, b, i):
        p = self.position[b, i]
        reach = ti.max(ti.sqrt(p.x * p.x + p.y * p.y), 1e-6)
        outward = vec3(p.x, p.y, 0.0) / reach
        side = self.look_up(self.half_space, self.cup_radius - reach)
        floor = self.look_up(self.half_space, p.z)
        self.wall[b, i] = (floor[1] * vec3(0.0, 0.0, 1.0) - side[1] * outward) / self.h
        grip = self.wall_grip(side, outward) + self.wall_grip(floor, vec3(0.0, 0.0, 1.0))
        self.grip_walls(b, i, grip, vec3(0.0))

        offset, lever = self.from_stick(b, p)
        distance = ti.max(offset.norm(), 1e-6)
        stick = self.look_up(self.stick_table, distance - self.core)
        self.body_wall[b, i] = (stick[1] / (distance * self.h)) * offset
        self.lever[b, i] = lever
        self.hide(b, (p - self.pivot[b]).dot(self.direction[b]), stick[0])
        share = self.unit_coupling * self.kinematic(b) / (self.h * self.h)
        self.stick_grip[b, i] = share * self.numerics.stick_drag * 0.5 * (stick[2] + stick[3])
        return side[0] + floor[0] + stick[0]

    @ti.func
    def wall_near(self, b, i, n: ti.template()):
        p = self.position[b, i]
        distance, normal = p.z, vec3(0.0, 0.0, 1.0)
        if ti.static(n == 1):
            reach = ti.max(ti.sqrt(p.x * p.x + p.y * p.y), 1e-6)
            distance, normal = self.cup_radius - reach, -vec3(p.x, p.y, 0.0) / reach
        return distance, normal, 1.0

    @ti.func
    def hide(self, b, lever, density):
        """Add a particle's share of the volume that the core does not displace."""
        if 0.0 < lever and lever < self.stick_length:
            volume = self.hidden_share * self.volume * density
            self.hidden_sum[b] = self.hidden_sum[b] + volume * vec3(1.0, lever, lever * lever)

    @ti.func
    def inertia(self, b):
        """Of the stick and of its hidden part's added mass, about the pivot [kg m²]."""
        return self.stick_inertia[b] + self.density[b] * self.hidden[b][2]

    @ti.func
    def across(self, b, v):
        """The part of v that turns the stick."""
        return v - v.dot(self.direction[b]) * self.direction[b]

    @ti.func
    def yielding(self, b, i):
        """A particle's mass times its lever, by the stick's inertia; 0 while the stick is held."""
        mass = self.density[b] * self.volume
        return self.free[b] * mass * self.lever[b, i] / self.inertia(b)

    @ti.func
    def body_softness(self, b, i):
        normal = self.across(b, self.body_wall[b, i])
        return self.yielding(b, i) * self.lever[b, i] * normal.dot(normal)

    @ti.func
    def body_velocity(self, b, i):
        return self.pivot_velocity[b] + self.lever[b, i] * self.swing[b]

    @ti.func
    def push_body(self, b, i, multiplier):
        push = multiplier * self.across(b, self.body_wall[b, i])
        self.swing[b] = self.swing[b] + self.yielding(b, i) * push

    @ti.func
    def body_thicken(self, b, i, ratio):
        self.stick_grip[b, i] = ratio * self.stick_grip[b, i]

    @ti.func
    def stick_scale(self, b):
        """Root of the stick's inertia over a particle's mass [m]."""
        return ti.sqrt(self.inertia(b) / (self.density[b] * self.volume))

    @ti.func
    def body_load(self, b):
        self.stick_search[b] = self.stick_scale(b) * self.swing[b]

    @ti.func
    def body_apply(self, b, moves):
        scale = self.stick_scale(b)
        search = self.stick_search[b]
        image = search
        for i in range(self.alive[b]):
            q = self.stick_grip[b, i]
            if q > 0.0:
                arm = self.lever[b, i] / scale
                slide = self.search_direction[b, i] - arm * search - moves * self.pivot_velocity[b]
                self.image[b, i] = self.image[b, i] + q * slide
                image -= (q * arm) * self.across(b, slide)
        self.stick_image[b] = image

    @ti.func
    def body_residual(self, b):
        r = self.free[b] * (self.stick_scale(b) * self.swing[b] - self.stick_image[b])
        self.stick_residual[b] = r
        self.stick_search[b] = r
        return r.dot(r)

    @ti.func
    def body_curvature(self, b):
        return self.stick_search[b].dot(self.stick_image[b])

    @ti.func
    def body_step(self, b, step):
        scale = self.stick_scale(b)
        self.swing[b] = self.swing[b] + (step / scale) * self.stick_search[b]
        r = self.stick_residual[b] - self.free[b] * step * self.stick_image[b]
        self.stick_residual[b] = r
        return r.dot(r)

    @ti.func
    def body_turn(self, b, share):
        self.stick_search[b] = self.stick_residual[b] + share * self.stick_search[b]

    @ti.func
    def contain(self, b):
        """Keep particles in the cup and off the stick; the stick takes what it gave."""
        sinking = self.float_stick(b)
        limit = self.cup_radius - self.margin
        for i in range(self.alive[b]):
            start = self.position[b, i]
            p = start
            offset, lever = self.from_stick(b, p)
            distance = offset.norm()
            if distance < self.core:
                out = (self.core - distance) / ti.max(distance, 1e-6) * offset
                p += out
                self.lever[b, i] = lever
                impulse = self.yielding(b, i) / self.dt * self.across(b, out)
                self.swing[b] = self.swing[b] - impulse
            reach = ti.sqrt(p.x * p.x + p.y * p.y)
            inward = ti.min(limit / ti.max(reach, 1e-6), 1.0)
            p = vec3(inward * p.x, inward * p.y, ti.max(p.z, self.margin))
            self.position[b, i] = p
            self.velocity[b, i] = self.velocity[b, i] + (p - start) / self.dt + sinking
        self.hidden[b] = self.hidden_sum[b]
        self.hidden_sum[b] = vec3(0.0)

    @ti.func
    def float_stick(self, b):
        """Lift of the hidden volume on the stick; the velocity that the liquid takes for it."""
        fall = vec3(0.0, 0.0, -GRAVITY * self.dt)
        lift = self.free[b] * self.density[b] * self.hidden_sum[b][1] / self.inertia(b)
        self.swing[b] = self.swing[b] - lift * self.across(b, fall)
        return self.hidden_sum[b][0] / (self.alive[b] * self.volume) * fall

    @ti.func
    def swing_stick(self, b, pivot):
        """Gravity and the pivot's acceleration on the pendulum, one substep."""
        velocity = (pivot - self.pivot[b]) / self.dt
        jolt = velocity - self.pivot_velocity[b]
        self.pivot[b], self.pivot_velocity[b] = pivot, velocity
        arm = 0.5 * self.stick_mass[b] * self.stick_length / self.inertia(b)
        dragged = self.density[b] * self.hidden[b][1] / self.inertia(b)
        # kick and drift swing (ω dt)²/24 too fast; the gradient of the kick's square makes up for
        # it (Rowlands 1991, J. Comput. Phys. 97, 235) and keeps them symplectic
        fall = GRAVITY * self.dt * (1.0 + arm * GRAVITY * self.dt**2 / 12.0 * self.direction[b].z)
        swing = self.swing[b] - arm * vec3(0.0, 0.0, fall) - (arm + dragged) * jolt
        self.swing[b] = self.across(b, swing)

    @ti.func
    def turn_stick(self, b):
        """Turn the stick by what the pivot's dry friction leaves of its swing.

        All impulses of the substep are in the swing by now, so a stick that they cannot turn
        stays where it is.
        """
        loss = self.dt * self.pivot_friction[b] / self.inertia(b)
        swing = self.swing[b]
        if loss > 0.0:
            swing *= ti.max(1.0 - loss / ti.max(swing.norm(), 1e-12), 0.0)
            self.swing[b] = swing
        u = self.direction[b]
        rate = swing.norm()
        angle = self.dt * rate
        if rate > 1e-12:
            ahead = swing / rate
            self.direction[b] = (ti.cos(angle) * u + ti.sin(angle) * ahead).normalized()
            self.swing[b] = rate * (ti.cos(angle) * ahead - ti.sin(angle) * u)

    @ti.kernel
    def stir(
        self,
        active: ti.i32,
        start: ti.i32,
        stop: ti.i32,
        path: ti.types.ndarray(dtype=ti.math.vec3, ndim=2),
        directions: ti.types.ndarray(dtype=ti.math.vec3, ndim=2),
        damping: ti.f32,
    ):
        """Substeps start..stop-1 of the first `active` trials.

        Args:
            path: Pivot at the end of each substep [m], shape [active, substeps].
            directions: Out: unit vector from pivot to tip at the same times.
            damping: Factor on the liquid's velocities after each substep; 1 but while it settles.
        """
        for k in range(active * STRIDE):
            if k % STRIDE == 0:
                b = k // STRIDE
                for n in range(start, stop):
                    self.swing_stick(b, path[b, n])
                    if self.fault[b] == SOUND:
                        self.flow(b)
                    self.turn_stick(b)
                    directions[b, n] = self.direction[b]
                    if damping < 1.0:
                        for i in range(self.alive[b]):
                            self.velocity[b, i] = damping * self.velocity[b, i]

    def settle(self, active, steps, damping):
        """Let the packings relax around the sticks, by the kernel that stirs: building another
        would double the time to the first result."""
        pivots = np.repeat(self.pivot.to_numpy()[:active, None], steps, axis=1)
        self.stir(active, 0, steps, pivots, np.empty_like(pivots), damping)

    def place_stick(self, pivots):
        """Hang the sticks straight down from `pivots` [b, 3], at rest."""
        self.pivot.from_numpy(self.padded(pivots))
        self.pivot_velocity.fill(0.0)
        self.hidden.fill(0.0)
        self.hidden_sum.fill(0.0)
        self.swing.fill(0.0)
        self.direction.from_numpy(np.tile(np.float32([0.0, 0.0, -1.0]), (self.slots, 1)))

    def hold_stick(self, held):
        """Whether the sticks stay as they are, whatever the liquid does."""
        self.free.fill(0.0 if held else 1.0)

    def fit_stick(self, mass, friction):
        """Give the sticks `mass` [kg] and their pivots dry `friction` [N m], both [b]."""
        full = np.ones(self.slots)
        full[: len(mass)] = mass
        self.stick_mass.from_numpy(full.astype(np.float32))
        self.stick_inertia.from_numpy((full * self.stick_gyration).astype(np.float32))
        self.pivot_friction.from_numpy(self.padded(friction))
