# type: ignore  (Taichi compiles this source and gives these names their types)
"""A stick hung from the gripper: a spherical pendulum, part of which the particles do not see.

The stick is about one particle wide. Particles keep off it by a part of their spacing, so at its
own radius it drags like a thicker one. To them it is thinner, see `stick_thinner` of
`ParticleNumerics` and the validation case `cylinder_drag`. What it displaces beyond that core acts
on it by closed forms: Archimedes' lift, whose reaction all liquid bears like that of a risen
surface, and the added mass of a cylinder in potential flow, which is what it displaces (Lamb 1932,
"Hydrodynamics", art. 68), as in liquid that does not itself accelerate. So vertical momentum
balances between stick and liquid, but the angular one only up to these two.
"""

import numpy as np
import taichi as ti

from .fluid import wall_tables
from .fluid.fluid import GRAVITY, Fluid, vec3


@ti.data_oriented
class HangingStick(Fluid):
    """Motion of the sticks, and the closed forms of what they hide."""

    def hang(self, stick):
        """Make the sticks' state; `stick` is a `Stick`."""
        self.core = self.numerics.stick_core(stick.radius, self.spacing)
        self.stick_length = stick.length
        # a capsule of the stick's volume: its round end reaches as far as the flat one on average
        self.stick_end = stick.length - 2.0 * stick.radius / 3.0
        self.stick_gyration = stick.gyration
        table = wall_tables.cylinder(self.core / self.h)
        self.stick_table = self.load(table)
        hidden = np.pi * (stick.radius**2 - self.core**2)  # [m²]
        around = self.h**2 * wall_tables.around_cylinder(table.density, self.core / self.h)
        self.hidden_share = hidden / around  # of a particle's volume, where the table is 1
        self.pivot, self.pivot_velocity, self.direction, self.swing = (
            ti.Vector.field(3, ti.f32, self.slots) for _ in range(4)
        )
        # volume that the core does not displace, and its first and second moment about the pivot
        self.hidden, self.hidden_sum = (ti.Vector.field(3, ti.f32, self.slots) for _ in range(2))
        self.stick_mass, self.stick_inertia, self.pivot_friction, self.free = (
            ti.field(ti.f32, self.slots) for _ in range(4)
        )
        self.fit_stick(np.full(self.slots, stick.mass), np.zeros(self.slots))
        self.free.fill(1.0)

    @ti.func
    def from_stick(self, b, p):
        """Offset of p from the stick's axis and the lever of the nearest point on it [m]."""
        arm = p - self.pivot[b]
        lever = ti.math.clamp(arm.dot(self.direction[b]), 0.0, self.stick_end)
        return arm - lever * self.direction[b], lever

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
