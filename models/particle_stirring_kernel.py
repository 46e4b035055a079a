# type: ignore  (Taichi compiles this source and gives these names their types)
"""The stirring scene: liquid in a cup, a stick hung from the gripper as a spherical pendulum."""

import numpy as np
import taichi as ti

from .fluid.faults import SOUND
from .fluid.fluid import STRIDE, vec3
from .hanging_stick import HangingStick


@ti.data_oriented
class StirringScene(HangingStick):
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
        self.hang(stick)
        self.stick_residual, self.stick_search, self.stick_image = (
            ti.Vector.field(3, ti.f32, slots) for _ in range(3)
        )
        self.lever, self.stick_grip = (ti.field(ti.f32, (slots, particles)) for _ in range(2))

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
        share = self.share(self.kinematic(b))
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

    def view(self, step):
        """The first stir now: particles [n, 3], pivot [3] and direction [3]."""
        position = self.position.to_numpy()[0, : self.alive.to_numpy()[0]]
        return position, self.pivot.to_numpy()[0].astype(np.float64), self.direction.to_numpy()[0]

    def settle(self, active, steps, damping):
        """Let the packings relax around the sticks, by the kernel that stirs: building another
        would double the time to the first result."""
        pivots = np.repeat(self.pivot.to_numpy()[:active, None], steps, axis=1)
        self.stir(active, 0, steps, pivots, np.empty_like(pivots), damping)
