# type: ignore  (Taichi compiles this source and gives these names their types)
"""Liquids in upright cups without a stick, which a force may turn about the axis."""

import taichi as ti
from bolfi_liquids.models.apic.gravity import GRAVITY
from bolfi_liquids.models.apic.lanes import LANES, vec3
from bolfi_liquids.models.apic.pressure import push
from bolfi_liquids.models.apic.surface import find_liquid, set_up_pressure
from bolfi_liquids.models.apic.transfer import move
from bolfi_liquids.models.apic.upright_cup import UprightCups
from bolfi_liquids.models.apic.viscosity import solve_viscosity, weigh_stresses

RINGS = 128


@ti.data_oriented
class StillCupScene(UprightCups):
    """The liquid of stirs, step by step as they do it.

    Attributes:
        turns: Azimuthal acceleration at distances from the axis from 0 to the cup's radius, even.
        strength: What multiplies it in each lane.
    """

    def __init__(self, groups, cells, particles, effects=()):
        """The arguments are those of `LiquidState`."""
        super().__init__(groups, cells, particles, effects)
        self.turns = ti.field(ti.f32, RINGS + 1)
        self.strength = ti.field(ti.f32, (groups, LANES))

    @ti.func
    def acceleration(self, g, lane, x):
        """Of a particle at x [m], by what acts on all liquid [m/s²]."""
        out = ti.max(ti.sqrt(x[0] ** 2 + x[1] ** 2), 1e-9)
        at = ti.min(out / self.cup_radius[None], 1.0 - 1e-6) * RINGS
        ring = ti.cast(ti.floor(at), ti.i32)
        turn = self.turns[ring] + (at - ring) * (self.turns[ring + 1] - self.turns[ring])
        turn *= self.strength[g, lane] / out
        return vec3(-turn * x[1], turn * x[0], -GRAVITY)

    @ti.kernel
    def give_speed(self, velocity: ti.types.ndarray(ti.f32, 4)):
        """Velocities of the particles [m/s], shape [groups, LANES, n, 3]."""
        for g, lane in ti.ndrange(velocity.shape[0], LANES):
            for n in range(self.count[g, lane]):
                for a in ti.static(range(3)):
                    self.speed[g, lane, n][a] = velocity[g, lane, n, a]

    @ti.func
    def take_step(self, g, step):
        self.transfer_in(g, step)
        find_liquid(self, g)
        set_up_pressure(self, g)
        push(self, g, self.pressure)
        weigh_stresses(self, g, step)
        solve_viscosity(self, g, step)
        self.project(g)
        move(self, g)
