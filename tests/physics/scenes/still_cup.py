"""Liquids of several viscosities in cups of one shape, without a stick, side by side."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from bolfi_liquids.models import runtime
from bolfi_liquids.models.apic.filling import Cylinder, fill_cup
from bolfi_liquids.models.apic.geometry import Geometry, from_cup, sample_geometry
from bolfi_liquids.models.apic.grid import Grid
from bolfi_liquids.models.apic.places import room_for
from bolfi_liquids.models.effect import Effect
from bolfi_liquids.models.effects import EFFECTS
from bolfi_liquids.models.faults import faulty

DENSITY = 1000.0  # kg/m³
LEAST_CELLS, LEAST_PARTICLES = 16000, 12000

Profile = Callable[[np.ndarray], np.ndarray]
"""Of velocity or acceleration around the axis, by the distance from it [m]."""


@dataclass(frozen=True)
class StillCup:
    """An upright cup and how its liquid is cut, as stirs of 5 mm cells do it.

    Attributes:
        radius, depth: Of the liquid [m].
        slippery_floor: The floor does not rub.
        cell: Edge of a cell [m].
        dt: Step [s].
        per_cell: Particles in a full cell.
    """

    radius: float = 0.04
    depth: float = 0.05
    slippery_floor: bool = False
    cell: float = 0.005
    dt: float = 0.012
    per_cell: int = 2

    def grid(self) -> Grid:
        return Grid.around_cup(self.cell, self.radius, self.depth)

    def room(self) -> tuple[int, int]:
        """Cells and particles that a scene has room for, the same for cups of about a size."""
        particles = self.per_cell * np.pi * self.radius**2 * (self.depth + self.cell) / self.cell**3
        return room_for(self.grid().cells, LEAST_CELLS), room_for(particles, LEAST_PARTICLES)

    def geometry(self) -> Geometry:
        """Of the cup; a slippery floor is so far below that nothing rubs at it, and shuts."""
        grid = self.grid()
        upright = sample_geometry(grid, from_cup(self.radius))
        if not self.slippery_floor:
            return upright
        tube = sample_geometry(grid, from_cup(self.radius, floor=False))
        return upright._replace(friction=tube.friction * upright.carries)


@dataclass(frozen=True)
class Flow:
    """What moves the liquid.

    Attributes:
        start: Velocity [m/s] of points (n, 3) [m].
        swirl: Acceleration around the axis [m/s²].
        strength: What multiplies `swirl` in each liquid, scalar or [B].
        effects: Coefficients of effects in the liquid by name, scalars or [B].
    """

    start: Callable[[np.ndarray], np.ndarray] = np.zeros_like
    swirl: Profile = np.zeros_like
    strength: float | np.ndarray = 1.0
    effects: Mapping[str, float | np.ndarray] = field(default_factory=dict)


def flow_in_cup(
    cup: StillCup,
    viscosity: np.ndarray,
    flow: Flow,
    seconds: float,
    look: Callable[[np.ndarray, np.ndarray], Any],
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """What one sees of flows in a cup.

    Args:
        cup: The cup.
        viscosity: Of B liquids of 1000 kg/m³ [Pa s].
        flow: Its start and what drives it.
        seconds: How long.
        look: From positions [m] and velocities [m/s] of a liquid's particles, each (n, 3), a number
            or an array of one shape. Velocities are half a step older than positions.
        seed: Of the particles' places.

    Returns:
        Times of the positions at the steps' ends [s], shape [steps], and what was seen then, shape
        [steps, B, ...]; NaN for a liquid that went wrong.

    Warns:
        FailedSimulation: a liquid went wrong.
    """
    viscosity = np.atleast_1d(np.asarray(viscosity, float))
    steps, size = round(seconds / cup.dt), len(viscosity)
    with runtime.LOCK:
        scene, groups = _started(cup, viscosity, flow, seed)
        seen = []
        for step in range(steps):
            scene.march(groups, step, step + 1)
            seen.append(_look(scene, size, look))
        status = scene.status.to_numpy().reshape(-1)[:size]
    found = np.array(seen, float)
    found[:, faulty(status, np.full(size, seed))] = np.nan
    return cup.dt * np.arange(1, steps + 1), found


def around(points: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Velocities (n, 3) of points that go around the axis at speeds (n,)."""
    x, y, out = points[:, 0], points[:, 1], np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-9)
    return np.stack([-y * speed / out, x * speed / out, np.zeros_like(out)], axis=1)


def swirl_of(points: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances from the axis [m] and speeds around it [m/s], each (n,)."""
    x, y = points[:, 0], points[:, 1]
    out = np.maximum(np.hypot(x, y), 1e-9)
    return out, (x * velocity[:, 1] - y * velocity[:, 0]) / out


def fill_scene(scene: Any, cup: StillCup, viscosity: np.ndarray, seed: int) -> np.ndarray:
    """Fill the first lanes of a scene with liquids at rest [Pa s]; where their particles are [m],
    shape (n, 3)."""
    grid = cup.grid()
    points = fill_cup(grid, Cylinder(cup.radius), cup.depth, cup.per_cell, seed)
    scene.enter_vessel(grid, cup.geometry(), cup.dt)
    volume = np.pi * cup.radius**2 * cup.depth / len(points) / cup.cell**3
    rows = [len(points), volume, viscosity / DENSITY, DENSITY, cup.depth]
    lanes = np.stack([of_lanes(row, len(viscosity)) for row in rows])
    # -1 where a lane has no liquid
    counts = np.where(lanes[0] > 0, lanes[0], -1).astype(np.int32)
    liquids = np.ascontiguousarray(lanes[1:])
    scene.fill_in(_in_all(points, *counts.shape), counts, liquids)
    return points


def of_lanes(values: Any, size: int) -> np.ndarray:
    """A scalar or (size,) as float32 [groups, LANES]; lanes without a liquid hold 0."""
    from bolfi_liquids.models.apic.lanes import LANES

    full = np.zeros(-(-size // LANES) * LANES, np.float32)
    full[:size] = values
    return full.reshape(-1, LANES)


def _started(cup: StillCup, viscosity: np.ndarray, flow: Flow, seed: int) -> tuple[Any, int]:
    """A scene with its liquids before the first step, and groups of lanes in it."""
    runtime.start()
    from .still_cup_scene import RINGS

    strength = of_lanes(flow.strength, len(viscosity))
    acting = tuple(EFFECTS[name] for name in flow.effects)
    scene = _scene(len(strength), *cup.room(), acting)
    scene.cup_radius[None] = cup.radius
    scene.turns.from_numpy(flow.swirl(np.linspace(0.0, cup.radius, RINGS + 1)).astype(np.float32))
    scene.strength.from_numpy(strength)
    points = fill_scene(scene, cup, viscosity, seed)
    scene.set_coefficients([of_lanes(row, len(viscosity)) for row in flow.effects.values()])
    scene.give_speed(_in_all(flow.start(points), *strength.shape))
    return scene, len(strength)


def _in_all(rows: np.ndarray, groups: int, lanes: int) -> np.ndarray:
    return np.tile(rows.astype(np.float32), (groups, lanes, 1, 1))


def _look(scene: Any, size: int, look: Callable[[np.ndarray, np.ndarray], Any]) -> list[Any]:
    count = scene.count.to_numpy().reshape(-1)
    position, velocity = (
        field.to_numpy().reshape(len(count), -1, 3).astype(float)
        for field in (scene.position, scene.speed)
    )
    most = count[:size].max()  # a liquid that went wrong has none
    return [look(position[k, :most], velocity[k, :most]) for k in range(size)]


@cache
def _scene(groups: int, cells: int, particles: int, effects: tuple[Effect, ...]) -> Any:
    from .still_cup_scene import StillCupScene

    return StillCupScene(groups, cells, particles, effects)
