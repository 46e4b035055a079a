"""Stirs of many liquids in groups of lanes."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from .. import runtime
from ..apic.filling import Cylinder, fill_cup
from ..apic.geometry import Geometry, from_cup, sample_geometry
from ..apic.grid import Grid
from ..apic.places import GROUPS, Places, room_for
from ..effect import Effect
from ..faults import faulty
from ..liquid import Liquid
from ..rig import Rig
from ..runtime import Watch
from ..stir_setup import StirSetup
from .slip_law import line_of

# the cells of the bundled recordings and coarser ones share a scene
LEAST_CELLS, LEAST_PARTICLES, LEAST_NODES, LEAST_WIDTH = 16000, 8000, 40, 8


class Stirs(NamedTuple):
    """Stirs of one setup.

    Attributes:
        liquid: A batch of B.
        rig: B of them; paths from the start of the first step to the end of the last.
        seeds: Shape [B].
        start: Unit vectors from pivot to tip at the start, shape [B, 3].
        coefficients: Of the effects in the liquid, shape [effects, B].
    """

    liquid: Liquid
    rig: Rig
    seeds: np.ndarray
    start: np.ndarray
    coefficients: np.ndarray

    def rows(self, part: np.ndarray) -> "Stirs":
        return Stirs(
            self.liquid[part],
            self.rig.rows(part),
            self.seeds[part],
            self.start[part],
            self.coefficients[:, part],
        )


def march(
    setup: StirSetup,
    stirs: Stirs,
    step: float,
    effects: tuple[Effect, ...] = (),
    watch: Watch | None = None,
) -> np.ndarray:
    """Directions of the sticks at the ends of all steps, shape [B, steps + 1, 3].

    Args:
        setup: Geometry and cells.
        stirs: What differs between them.
        step: Of time [s].
        effects: In the liquid; they act in all.
        watch: What looks on.

    Warns:
        FailedSimulation: a stir went wrong; its directions are NaN.
    """
    runtime.start()
    from ..apic.lanes import LANES

    # a group iterates until its slowest lane has converged
    order = np.argsort(stirs.liquid.viscosity, kind="stable")
    directions = np.empty((len(order), stirs.rig.path.shape[1], 3))
    for low in range(0, len(order), GROUPS * LANES):
        part = order[low : low + GROUPS * LANES]
        directions[part] = _together(setup, stirs.rows(part), step, effects, watch)
    return directions


def _together(setup, stirs: Stirs, step, effects, watch) -> np.ndarray:
    """Like `march`, for at most as many stirs as there are lanes."""
    from ..apic.lanes import LANES

    cup, places = setup.cup, Places(len(stirs.seeds), GROUPS, LANES)
    grid, geometry = _vessel(setup.cell, cup.radius, setup.deepest)
    scene = _scene_for(setup, grid, effects)
    scene.enter_vessel(grid, geometry, step)
    scene.rate = 1.0 / step
    scene.cup_radius[None] = cup.radius
    scene.sticks.fit(setup.stick, setup.cell, setup.deepest)

    liquid, fill = stirs.liquid, stirs.rig.fill
    points = [
        fill_cup(grid, Cylinder(cup.radius), float(depth), setup.per_cell, int(seed))
        for depth, seed in zip(fill, stirs.seeds, strict=True)
    ]
    positions, counts = places.spread_points(points)
    most = np.maximum([len(one) for one in points], 1)
    share = np.pi * cup.radius**2 * fill / most / grid.cell**3
    nu = np.asarray(liquid.viscosity) / np.asarray(liquid.density)
    rows = share, nu, np.asarray(liquid.density), fill
    scene.fill_in(positions, counts, np.stack([places.spread(row) for row in rows]))
    scene.set_coefficients([places.spread(row) for row in stirs.coefficients])
    masses = stirs.rig.stick_mass, stirs.rig.pivot_friction
    scene.sticks.hang(np.stack([places.spread(row) for row in (*stirs.start.T, *masses)]))

    path = stirs.rig.path
    ahead = 2.0 * path[:, -1:] - path[:, -2:-1]
    path = places.spread(np.concatenate([path[:, :1], path, ahead], axis=1))
    steps = path.shape[2] - 3
    directions = np.empty((*path.shape[:2], steps + 1, 3), np.float32)
    directions[:, :, 0] = places.spread(stirs.start)
    scene.begin(path, directions, len(points[0]))
    runtime.run_chunks(scene, steps, scene.march, watch)
    found = places.gather(directions).astype(np.float64)
    found[faulty(places.gather(scene.status.to_numpy()), stirs.seeds)] = np.nan
    return found


@cache
def _vessel(cell: float, radius: float, depth: float) -> tuple[Grid, Geometry]:
    grid = Grid.around_cup(cell, radius, depth)
    return grid, sample_geometry(grid, from_cup(radius))


def _scene_for(setup: StirSetup, grid: Grid, effects: tuple[Effect, ...]) -> Any:
    """A scene with room for a setup; setups of about one size share it."""
    line = line_of(setup.stick.radius, setup.cell, setup.deepest)
    column = np.pi * setup.cup.radius**2 * (setup.deepest + setup.cell) / setup.cell**3
    return _scene(
        room_for(grid.cells, LEAST_CELLS),
        room_for(1.1 * column * setup.per_cell, LEAST_PARTICLES),
        (room_for(line.nodes, LEAST_NODES), room_for(2 * line.half_width, LEAST_WIDTH)),
        effects,
    )


@cache
def _scene(cells: int, particles: int, line: tuple[int, int], effects: tuple[Effect, ...]) -> Any:
    """A scene; its fields live as long as the process."""
    runtime.start()
    from .scene import StirringScene

    return StirringScene(GROUPS, cells, particles, line, effects)
