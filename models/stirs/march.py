"""Stirs of many liquids in groups of lanes."""

import math
import os
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..apic.filling import fill_cup
from ..apic.geometry import Geometry, from_cup, sample_geometry
from ..apic.grid import Grid
from ..effect import Effect
from ..fluid import runtime
from ..fluid.faults import faulty
from ..fluid.liquid import Liquid
from ..fluid.runtime import Watch
from ..rig import Rig
from ..stir_setup import StirSetup
from .slip_law import line_of


def processors() -> int:
    """That this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


GROUPS = processors()  # that march at the same time, each on its own processor
LEAST_CELLS, LEAST_PARTICLES, LEAST_NODES, LEAST_WIDTH = 16000, 6000, 40, 8
GROWTH = 1.5  # of the room from one scene to the next


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
    """What `march` returns, of at most as many stirs as there are lanes."""
    from ..apic.lanes import LANES

    cup, slots = setup.cup, slots_of(len(stirs.seeds), GROUPS, LANES)
    groups = slots[-1] // LANES + 1
    grid, geometry = _vessel(setup.cell, cup.radius, setup.deepest)
    scene = _scene_for(setup, grid, effects)
    scene.enter_vessel(grid, geometry, step)
    scene.rate = 1.0 / step
    scene.cup_radius[None] = cup.radius
    scene.sticks.fit(setup.stick, setup.cell, setup.deepest)

    def lanes(values: np.ndarray) -> np.ndarray:
        """[B, ...] as float32 [groups, LANES, ...]; lanes without a stir hold ones."""
        full = np.ones((groups * LANES, *values.shape[1:]), np.float32)
        full[slots] = values
        return full.reshape(groups, LANES, *values.shape[1:])

    positions, counts = _filled(setup, grid, stirs, slots, groups * LANES)
    liquid, fill = stirs.liquid, stirs.rig.fill
    share = np.pi * cup.radius**2 * fill / np.maximum(counts[slots], 1) / grid.cell**3
    nu = np.asarray(liquid.viscosity) / np.asarray(liquid.density)
    scene.fill_in(
        positions.reshape(groups, LANES, -1, 3),
        counts.reshape(groups, LANES),
        np.stack([lanes(row) for row in (share, nu, np.asarray(liquid.density), fill)]),
    )
    scene.set_coefficients(np.stack([lanes(row) for row in stirs.coefficients]) if effects else ())
    masses = stirs.rig.stick_mass, stirs.rig.pivot_friction
    scene.sticks.hang(np.stack([lanes(row) for row in (*stirs.start.T, *masses)]))

    path = stirs.rig.path
    ahead = 2.0 * path[:, -1:] - path[:, -2:-1]
    path = lanes(np.concatenate([path[:, :1], path, ahead], axis=1))
    directions = np.empty((groups, LANES, path.shape[2] - 2, 3), np.float32)
    directions[:, :, 0] = lanes(stirs.start)
    scene.begin(path, directions, int(counts[0]))
    runtime.run_chunks(scene, directions.shape[2] - 1, scene.march, watch)
    found = directions.reshape(groups * LANES, -1, 3)[slots].astype(np.float64)
    status = scene.status.to_numpy().reshape(-1)[slots]
    found[faulty(status, stirs.seeds)] = np.nan
    return found


def slots_of(size: int, groups: int, lanes: int) -> np.ndarray:
    """Places of so many stirs among the lanes of all groups, shape [size].

    Groups share them evenly, so that few stirs keep all processors busy. Neighbours march together.
    """
    each = math.ceil(size / min(groups, size))
    number = np.arange(size)
    return number // each * lanes + number % each


def _filled(
    setup: StirSetup, grid: Grid, stirs: Stirs, slots: np.ndarray, room: int
) -> tuple[np.ndarray, np.ndarray]:
    """Where the particles start [m], shape [room, n, 3], and how many there are."""
    per_cell, radius = setup.per_cell, setup.cup.radius
    points = [
        fill_cup(grid, radius, float(fill), per_cell, int(seed))
        for fill, seed in zip(stirs.rig.fill, stirs.seeds, strict=True)
    ]
    counts = np.full(room, -1, np.int32)
    counts[slots] = [len(one) for one in points]
    positions = np.zeros((room, max(counts.max(), 1), 3), np.float32)
    for slot, one in zip(slots, points, strict=True):
        positions[slot, : len(one)] = one
    return positions, counts


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


def room_for(needed: float, least: int) -> int:
    """Room that scenes of about this size share, so that one is compiled for all."""
    doublings = max(0, math.ceil(math.log(needed / least, GROWTH) - 1e-9))
    return math.ceil(least * GROWTH**doublings)


@cache
def _scene(cells: int, particles: int, line: tuple[int, int], effects: tuple[Effect, ...]) -> Any:
    """A scene; its fields live as long as the process."""
    runtime.start()
    from .scene import StirringScene

    return StirringScene(GROUPS, cells, particles, line, effects)
