# type: ignore  (Taichi compiles this source and gives these names their types)
"""Groups of stirs in cups and with sticks of one shape."""

import numpy as np
import taichi as ti

from ..apic.gravity import GRAVITY
from ..apic.lanes import LANES, STRIDE, vec3
from ..apic.pressure import push
from ..apic.surface import find_liquid, set_up_pressure
from ..apic.transfer import move
from ..apic.upright_cup import UprightCups
from ..apic.viscosity import solve_viscosity, weigh_stresses
from ..faults import SOUND
from .stick_line import StickLine, slip_line, start_line


@ti.data_oriented
class StirringScene(UprightCups):
    """Liquids in upright cups, stirred by sticks.

    All velocities are those at the middle of a step, positions and directions those at its start.
    A step reads the pivots' path, so this scene has a `march` of its own.
    """

    def __init__(self, groups, cells, particles, line, effects=()):
        """
        Args:
            groups, cells, particles, effects: As for `LiquidState`.
            line: Nodes of a stick, and cells of a kernel's width, at most.
        """
        super().__init__(groups, cells, particles, effects)
        self.sticks = StickLine(groups, *line)

    @ti.func
    def acceleration(self, g, lane, x):
        """Acceleration of a particle at x [m] by what acts on all liquid [m/s²]."""
        return vec3(0.0, 0.0, -GRAVITY)

    @ti.func
    def hold(self, path: ti.template(), g, lane, step):
        """Take the pivot's place and motion in a step."""
        before, now, after = path[g, lane, step], path[g, lane, step + 1], path[g, lane, step + 2]
        dt = self.dt[None]
        self.sticks.pivot[g, lane] = now
        self.sticks.velocity[g, lane] = (after - now) / dt
        self.sticks.jolt[g, lane] = (after - 2.0 * now + before) / dt**2

    @ti.kernel
    def _march(
        self,
        groups: ti.i32,
        start: ti.i32,
        stop: ti.i32,
        path: ti.types.ndarray(vec3, 3),
        directions: ti.types.ndarray(vec3, 3),
    ):
        for n in range(groups * STRIDE):
            if n % STRIDE == 0:
                g = n // STRIDE
                for step in range(start, stop):
                    self.take_step(g, step, path)
                    for lane in range(LANES):
                        directions[g, lane, step + 1] = self.sticks.direction[g, lane]

    @ti.func
    def take_step(self, g, step, path: ti.template()):
        self.transfer_in(g, step)
        find_liquid(self, g)
        set_up_pressure(self, g)
        for lane in range(LANES):
            if self.status[g, lane] == SOUND:
                self.hold(path, g, lane, step)
                start_line(self, self.sticks, g, lane)
        push(self, g, self.pressure)
        weigh_stresses(self, g, step)
        solve_viscosity(self, g, step)
        for lane in range(LANES):
            if self.status[g, lane] == SOUND:
                slip_line(self, self.sticks, g, lane, (step + 0.5) * self.dt[None])
        self.project(g)
        move(self, g)

    def begin(self, path, directions, count):
        """Take what the steps read and fill in.

        Args:
            path: Pivots [m], float32 of shape [groups, LANES, steps + 2, 3], from one step before
                the start on.
            directions: Of the sticks at the steps' ends, float32 of shape
                [groups, LANES, steps + 1, 3].
            count: Of the first stir's particles, of which a fault leaves none.
        """
        self.path, self.directions, self.shown = path, directions, count

    def march(self, start, stop):
        """March from step `start` to `stop` - 1."""
        self._march(len(self.path), start, stop, self.path, self.directions)

    def view(self, step):
        """The first stir at a step's start: particles [n, 3], pivot [3] and direction [3]."""
        position = self.position.to_numpy()[0, 0, : self.shown]
        pivot = self.path[0, 0, step + 1].astype(np.float64)
        return position, pivot, self.directions[0, 0, step]
