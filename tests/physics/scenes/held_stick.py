"""An upright stick that is moved through liquids in a cup and cannot swing."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from bolfi_liquids.models import runtime
from bolfi_liquids.models.apic.places import room_for
from bolfi_liquids.models.faults import faulty
from bolfi_liquids.models.stir_setup import Stick
from bolfi_liquids.models.stirs.march import LEAST_NODES, LEAST_WIDTH
from bolfi_liquids.models.stirs.slip_law import TIP, line_of

from .still_cup import DENSITY, StillCup, fill_scene, of_lanes

LENGTH, MASS = 0.22, 0.015  # m, kg: without effect while the stick is held

Path = Callable[[np.ndarray], np.ndarray]
"""Places x of the B sticks [m] at times (t,) [s], shape [B, t]."""


class Slip(NamedTuple):
    """What a held stick's law of slip gives the liquid.

    Attributes:
        time: The middles of the steps [s], shape [steps].
        force: Along x, per length [N/m], shape [steps, B]: all but the impulse of the displaced
            mass, which is known from the path.
    """

    time: np.ndarray
    force: np.ndarray


def slip_forces(
    cup: StillCup, radius: float, viscosity: np.ndarray, path: Path, seconds: float, seed: int = 0
) -> Slip:
    """Forces in the middle third of the depth, of a stick whose lower end is at the floor.

    Args:
        cup: The cup.
        radius: Of the stick [m].
        viscosity: Of B liquids of 1000 kg/m³ [Pa s].
        path: Of the sticks.
        seconds: How long.
        seed: Of the particles' places.

    Warns:
        FailedSimulation: a liquid went wrong; its forces are NaN.
    """
    viscosity = np.atleast_1d(np.asarray(viscosity, float))
    steps, size = round(seconds / cup.dt), len(viscosity)
    with runtime.LOCK:
        runtime.start()
        scene = _scene_for(cup, radius, len(of_lanes(0.0, size)))
        points = fill_scene(scene, cup, viscosity, seed)
        scene.cup_radius[None] = cup.radius
        scene.sticks.fit(Stick(radius, LENGTH, MASS), cup.cell, cup.depth)
        upright = [of_lanes(row, size) for row in (0.0, 0.0, -1.0, MASS, 0.0)]
        scene.sticks.hang(np.stack(upright))
        direction = np.stack(upright[:3], axis=-1)
        held = np.zeros((*scene.sticks.direction.shape, 3), np.float32)
        held[: len(direction)] = direction
        x = path(cup.dt * np.arange(-1, steps + 1))
        pivots = np.stack([of_lanes(at, size) for at in x.T], axis=2)
        pivots = np.stack([pivots, np.zeros_like(pivots), np.full_like(pivots, LENGTH)], axis=-1)
        unseen = np.empty((*direction.shape[:2], steps + 1, 3), np.float32)
        scene.begin(pivots, unseen, len(points))
        carried = []
        for step in range(steps):
            carried.append(_held_step(scene, held, step, size))
        status = scene.status.to_numpy().reshape(-1)[:size]
    line = line_of(radius, cup.cell, cup.depth)
    height = (TIP + 0.5 + np.arange(line.nodes)) * cup.cell
    middle = np.flatnonzero((height > cup.depth / 3.0) & (height < cup.depth / 1.5))
    found = np.array(carried)[..., middle].mean(axis=-1).astype(float)
    found[:, faulty(status, np.full(size, seed))] = np.nan
    time = cup.dt * (np.arange(steps) + 0.5)
    return Slip(time, DENSITY * line.node_volume * cup.cell**2 * found)


def _held_step(scene: Any, direction: np.ndarray, step: int, size: int) -> np.ndarray:
    """Accelerations along x that the nodes carry after a step [m/s²], shape [B, nodes]."""
    scene.march(step, step + 1)
    scene.sticks.direction.from_numpy(direction)
    scene.sticks.swing.fill(0.0)
    scene.sticks.turning.fill(0.0)
    carried = scene.sticks.carried.to_numpy()[..., 0]
    return carried.reshape(-1, carried.shape[-1])[:size]


def _scene_for(cup: StillCup, radius: float, groups: int) -> Any:
    line = line_of(radius, cup.cell, cup.depth)
    width = room_for(2 * line.half_width, LEAST_WIDTH)
    return _scene(groups, *cup.room(), room_for(line.nodes, LEAST_NODES), width)


@cache
def _scene(groups: int, cells: int, particles: int, nodes: int, width: int) -> Any:
    from bolfi_liquids.models.stirs.scene import StirringScene

    return StirringScene(groups, cells, particles, (nodes, width))
