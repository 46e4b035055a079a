# type: ignore  (Taichi compiles this source and gives these names their types)
"""Fields of groups of liquids that march together."""

import numpy as np
import taichi as ti

from ..effect_check import check_rheology
from ..faults import ABSENT, SOUND
from .gravity import GRAVITY
from .lanes import LANES, STRIDE, lanes, mat3, vec3
from .mirror import clear_images, fold, reflect_velocity
from .pressure import add_rise, push, solve_pressure
from .surface import LIQUID
from .transfer import CELLS, clear, deposit, empty, list_cells, mark_cell
from .viscosity import extend


@ti.data_oriented
class LiquidState:
    """Particles and grid of `groups` times `LANES` liquids in vessels of one shape.

    Room is allocated once. The sizes of a scene are numbers in fields, so kernels that were
    compiled for one scene serve all.

    Attributes:
        velocity, mass: Of faces, in m/s and full cells.
        volume: Deposited in a cell, in full cells.
        fraction: Of the cell's capacity.
        liquid: 1 in cells that have pressure.
        pressure: Times step over density and cell [m/s].
        status: How a lane fares, a code of `faults`.

    A scene is a subclass with the functions `take_step` of a group, and `accelerate`, which changes
    a particle's velocity, and its slope, by what acts on all liquid. A step is `transfer_in`, what
    the scene does with the velocities, `project`, and how it moves particles, with `mark_cell` of
    where each comes to. If it is SIDED, it has the field `side` of the faces along each axis and of
    cells, with those of the next ones as in `four`, and the function `side_of` a point.
    """

    UPRIGHT = True  # gravity is along -z
    WETTING = False  # its surface pulls, and walls are wetted
    SIDED = False  # liquid is on both sides of walls that may be thinner than a cell
    MIRRORED = False  # only y >= 0 is simulated, beyond two layers of cells
    LEAST_AT_WALL = LIQUID  # share of its capacity from which a cell close to a wall is liquid
    MENDING_TIME = 0.08  # s in which a wrong density is mended
    TOLERANCE = 5e-3  # of the divergence that pressure leaves

    def __init__(self, groups, cells, particles, effects=()):
        """
        Args:
            groups: Groups of lanes.
            cells, particles: Room for so many in each.
            effects: Liquid `Effect`s that act in all lanes, in this order.
        """
        self.groups, self.cells, self.particles = groups, cells, particles

        def of_cells():
            return ti.Vector.field(LANES, ti.f32, (groups, cells))

        def of_faces():
            return ti.Vector.field(LANES, ti.f32, (groups, 3, cells))

        self.velocity, self.mass, self.inverse = of_faces(), of_faces(), of_faces()
        self.rest, self.search, self.product = of_faces(), of_faces(), of_faces()
        self.friction, self.coupling = of_faces(), of_faces()
        self.shear, self.shear_weight = of_faces(), of_faces()
        self.volume, self.fraction, self.liquid = (of_cells() for _ in range(3))
        self.pressure, self.rise, self.source, self.diagonal = (of_cells() for _ in range(4))
        self.cell_rest, self.cell_search, self.cell_product = (of_cells() for _ in range(3))
        self.normal_weight = of_cells()

        # what particles give to four faces along each axis, and to four cells
        self.weights, self.momenta = (
            [ti.Vector.field(4, ti.f32) for _ in range(lattices)] for lattices in (CELLS + 1, 3)
        )
        ti.root.dense(ti.ij, (groups, cells)).place(*self.weights, *self.momenta)

        # of the vessel
        self.usable, self.open_volume, self.capacity, self.least = (
            ti.field(ti.f32, cells) for _ in range(4)
        )
        self.area, self.carries, self.shut, self.rub, self.solid, self.edge = (
            ti.field(ti.f32, (3, cells)) for _ in range(6)
        )
        self.shape = ti.Vector.field(3, ti.i32, ())
        self.origin = ti.Vector.field(3, ti.f32, ())
        self.cell, self.dt = ti.field(ti.f32, ()), ti.field(ti.f32, ())

        # cells within one and two cells of a particle, and those of liquid
        self.mark, self.spread = (ti.field(ti.i32, (groups, cells)) for _ in range(2))
        self.near, self.around, self.wet = (ti.field(ti.i32, (groups, cells)) for _ in range(3))
        self.nears, self.arounds, self.wets = (ti.field(ti.i32, groups) for _ in range(3))

        self.position, self.speed = (
            ti.Vector.field(3, ti.f32, (groups, LANES, particles)) for _ in range(2)
        )
        self.slope = ti.Matrix.field(3, 3, ti.f32, (groups, LANES, particles))
        self.count, self.status = (ti.field(ti.i32, (groups, LANES)) for _ in range(2))
        self.particle, self.viscosity, self.density, self.level = (
            ti.Vector.field(LANES, ti.f32, groups) for _ in range(4)
        )
        self.lack = ti.Vector.field(LANES, ti.f32, groups)  # of density, where the level is high

        for effect in effects:
            check_rheology(effect)
        self.rheologies = [effect.make_rheology() for effect in effects]
        if self.rheologies:
            self.thickness = of_cells()  # viscosity of a cell [m²/s]
            self.coefficient = ti.Vector.field(LANES, ti.f32, (len(effects), groups))

    def enter_vessel(self, grid, geometry, dt):
        """Take a vessel's `Grid` and `Geometry`, and a step [s]."""
        g = geometry
        least = np.where(g.beside > 0.0, self.LEAST_AT_WALL, LIQUID).astype(np.float32)
        self._enter_vessel(
            np.array(grid.shape, np.int32),
            np.array([*grid.origin, grid.cell, dt], np.float32),
            np.stack([g.usable, g.volume, g.capacity, least]),
            np.stack([g.area, g.carries, g.shut, g.friction, g.solid, g.edge]),
        )

    @ti.kernel
    def _enter_vessel(
        self,
        shape: ti.types.ndarray(ti.i32, 1),
        lengths: ti.types.ndarray(ti.f32, 1),
        of_cells: ti.types.ndarray(ti.f32, 2),
        of_faces: ti.types.ndarray(ti.f32, 3),
    ):
        for _ in range(1):
            for a in ti.static(range(3)):
                self.shape[None][a] = shape[a]
                self.origin[None][a] = lengths[a]
            self.cell[None] = lengths[3]
            self.dt[None] = lengths[4]
        for m in range(of_cells.shape[1]):
            self.usable[m] = of_cells[0, m]
            self.open_volume[m] = of_cells[1, m]
            self.capacity[m] = of_cells[2, m]
            self.least[m] = of_cells[3, m]
            for a in range(3):
                self.area[a, m] = of_faces[0, a, m]
                self.carries[a, m] = of_faces[1, a, m]
                self.shut[a, m] = of_faces[2, a, m]
                self.rub[a, m] = of_faces[3, a, m]
                self.solid[a, m] = of_faces[4, a, m]
                self.edge[a, m] = of_faces[5, a, m]

    @ti.kernel
    def fill_in(
        self,
        position: ti.types.ndarray(ti.f32, 4),
        count: ti.types.ndarray(ti.i32, 2),
        liquid: ti.types.ndarray(ti.f32, 3),
    ):
        """Fill in liquid at rest, in equilibrium.

        Args:
            position: Of the particles [m], shape [groups, LANES, n, 3].
            count: Of particles, shape [groups, LANES]; -1 where a lane has no simulation, which
                takes no time.
            liquid: Volume of a particle [full cells], kinematic viscosity [m²/s], density [kg/m³]
                and height of the level [m], shape [4, groups, LANES].
        """
        for g in range(position.shape[0]):
            clear(self, g)
            empty(self, g)
            self.arounds[g], self.nears[g], self.wets[g] = 0, 0, 0
            if ti.static(len(self.rheologies) > 0):
                for m in range(self.thickness.shape[1]):
                    self.thickness[g, m] = lanes(0.0)
            self.lack[g] = lanes(0.0)
            for lane in range(LANES):
                self.count[g, lane] = ti.max(count[g, lane], 0)
                self.status[g, lane] = SOUND if count[g, lane] >= 0 else ABSENT
                self.particle[g][lane] = liquid[0, g, lane]
                self.viscosity[g][lane] = liquid[1, g, lane]
                self.density[g][lane] = liquid[2, g, lane]
                self.level[g][lane] = liquid[3, g, lane]
                for n in range(count[g, lane]):
                    for a in ti.static(range(3)):
                        self.position[g, lane, n][a] = position[g, lane, n, a]
                    self.speed[g, lane, n] = vec3(0.0)
                    self.slope[g, lane, n] = mat3(0.0)
                    mark_cell(self, g, self.position[g, lane, n])
            cell = self.cell[None]
            layer = self.shape[None][0] * self.shape[None][1]
            for m in range(layer * self.shape[None][2]):
                z = self.origin[None][2] + (m // layer + 0.5) * cell
                weight = self.usable[m] * GRAVITY * self.dt[None] / cell
                for lane in range(LANES):
                    self.pressure[g, m][lane] = weight * ti.max(self.level[g][lane] - z, 0.0)

    def set_coefficients(self, coefficients):
        """Set the effects' coefficients, shape [effects, groups, LANES]."""
        for effect, of_groups in enumerate(coefficients):
            for g, values in enumerate(of_groups):
                self.coefficient[effect, g] = values

    @ti.func
    def begin_step(self, g, step):
        """Hook: a scene's work on a group before its particles are accelerated."""

    @ti.kernel
    def march(self, groups: ti.i32, start: ti.i32, stop: ti.i32):
        """March so many groups from step `start` to `stop` - 1; none waits for another."""
        for n in range(groups * STRIDE):
            if n % STRIDE == 0:
                for step in range(start, stop):
                    self.take_step(n // STRIDE, step)

    @ti.func
    def transfer_in(self, g, step):
        clear(self, g)
        if ti.static(self.MIRRORED):
            clear_images(self, g)
        self.begin_step(g, step)
        list_cells(self, g)
        deposit(self, g)
        if ti.static(self.MIRRORED):
            fold(self, g)

    @ti.func
    def project(self, g):
        solve_pressure(self, g)
        push(self, g, self.rise)
        add_rise(self, g)
        extend(self, g)
        if ti.static(self.MIRRORED):
            reflect_velocity(self, g)
