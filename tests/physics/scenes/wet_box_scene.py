# type: ignore  (Taichi compiles this source and gives these names their types)
"""Liquids with surface tension in boxes of one shape."""

import taichi as ti
from bolfi_liquids.models.apic.filling import OFF_WALL
from bolfi_liquids.models.apic.lanes import LANES
from bolfi_liquids.models.apic.transfer import fault_of, mark_cell, motion_of, place_after
from bolfi_liquids.models.apic.wetting_liquid import WettingLiquid
from bolfi_liquids.models.faults import SOUND


@ti.data_oriented
class WetBoxScene(WettingLiquid):
    """The liquid of pours, step by step as they do it, in a room that stands still.

    Attributes:
        pull: Acceleration of all of a lane's liquid [m/s²].
        lowest, highest: Corners of the inside [m].
        block_lowest, block_highest: Corners of a block within it [m].
    """

    def __init__(self, groups, cells, particles):
        super().__init__(groups, cells, particles)
        self.pull = ti.Vector.field(3, ti.f32, (groups, LANES))
        self.lowest, self.highest, self.block_lowest, self.block_highest = (
            ti.Vector.field(3, ti.f32, ()) for _ in range(4)
        )

    @ti.kernel
    def drive(self, pull: ti.types.ndarray(ti.f32, 3), velocity: ti.types.ndarray(ti.f32, 4)):
        """Accelerations of lanes [m/s²], shape [groups, LANES, 3], and velocities of particles
        at the start [m/s], shape [groups, LANES, n, 3]."""
        for g, lane in ti.ndrange(velocity.shape[0], LANES):
            for a in ti.static(range(3)):
                self.pull[g, lane][a] = pull[g, lane, a]
            for n in range(self.count[g, lane]):
                for a in ti.static(range(3)):
                    self.speed[g, lane, n][a] = velocity[g, lane, n, a]

    @ti.func
    def accelerate(self, g, lane, n):
        self.speed[g, lane, n] = self.speed[g, lane, n] + self.dt[None] * self.pull[g, lane]

    @ti.func
    def keep_inside(self, after, velocity):
        """Where a particle comes to that the walls stop, and its velocity."""
        x, v = after, velocity
        off = OFF_WALL * self.cell[None]
        for a in ti.static(range(3)):
            low, high = self.lowest[None][a] + off, self.highest[None][a] - off
            if x[a] < low:
                x[a], v[a] = low, ti.max(v[a], 0.0)
            if x[a] > high:
                x[a], v[a] = high, ti.min(v[a], 0.0)
        axis, to, nearest = 0, 0.0, 1e30
        inside = True
        for a in ti.static(range(3)):  # leave the block by its nearest face
            low, high = self.block_lowest[None][a] - off, self.block_highest[None][a] + off
            inside = inside and x[a] > low and x[a] < high
            if x[a] - low < nearest:
                axis, to, nearest = a, low, x[a] - low
            if high - x[a] < nearest:
                axis, to, nearest = a, high, high - x[a]
        if inside:
            for a in ti.static(range(3)):
                if a == axis:
                    v[a] = ti.select(to < x[a], ti.min(v[a], 0.0), ti.max(v[a], 0.0))
                    x[a] = to
        return x, v

    @ti.func
    def transfer_out(self, g, step):
        for lane in range(LANES):
            self.move(g, lane)

    @ti.func
    def move(self, g, lane):
        """A lane that went wrong gets its status and loses its particles."""
        energy, fastest = 0.0, 0.0
        for n in range(self.count[g, lane]):
            v, slope = motion_of(self, g, lane, n)
            self.slope[g, lane, n] = slope
            moved = place_after(self, self.position[g, lane, n], v, slope)
            self.position[g, lane, n], self.speed[g, lane, n] = self.keep_inside(moved, v)
            mark_cell(self, g, self.position[g, lane, n])
            energy += v.dot(v)
            fastest = ti.max(fastest, v.dot(v))
        self.status[g, lane] = fault_of(self, g, lane, energy, fastest)
        if self.status[g, lane] != SOUND:
            self.count[g, lane] = 0
