"""Boxes of liquids that have surface tension and wet walls, side by side."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, reduce
from typing import Any, NamedTuple

import numpy as np
from bolfi_liquids.models import runtime
from bolfi_liquids.models.apic.filling import JITTER, OFF_WALL
from bolfi_liquids.models.apic.geometry import NEAREST_OF_FILMS, Geometry, sample_geometry
from bolfi_liquids.models.apic.gravity import GRAVITY
from bolfi_liquids.models.apic.grid import WALL, Grid
from bolfi_liquids.models.apic.places import GROUPS, Places
from bolfi_liquids.models.faults import faulty

CELLS, PARTICLES = 20000, 8000  # room that all boxes share, so that one scene is compiled

Point = tuple[float, float, float]
NO_PULL: Point = (0.0, 0.0, 0.0)
Block = tuple[Point, Point]
"""Lowest and highest corner [m]."""


@dataclass(frozen=True)
class WetBox:
    """A closed box whose lowest corner is the origin, cut into cells as pours are.

    A flat one is a cell thick along y. Its sides there neither rub nor have a contact angle, and
    all particles are in the plane between them: what flows is the same along y.

    Attributes:
        size: Along x, y and z [m], whole cells; y is of no account in a flat box.
        cell: Edge of a cell [m].
        dt: Step [s].
        flat: Whether it is a cell thick.
        block: Of wall within it, at least two cells thick, its faces on those of cells.
    """

    size: Point
    cell: float = 0.004
    dt: float = 0.003
    flat: bool = True
    block: Block | None = None

    @property
    def highest(self) -> Point:
        """Corner of the inside [m]."""
        x, y, z = self.size
        return x, self.cell if self.flat else y, z

    def grid(self) -> Grid:
        x, y, z = (round(length / self.cell) + 2 * WALL for length in self.highest)
        side = -WALL * self.cell
        return Grid(self.cell, (x, y, z), (side, side, side))

    def distance(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Of points from the walls [m], negative within them."""
        high_x, high_y, high_z = self.highest
        away = np.minimum(np.minimum(x, high_x - x), np.minimum(z, high_z - z))
        if not self.flat:
            away = np.minimum(away, np.minimum(y, high_y - y))
        if self.block is None:
            return away
        axes = (0, 2) if self.flat else (0, 1, 2)
        return np.minimum(away, _from_block(self.block, axes, (x, y, z)))

    def geometry(self) -> Geometry:
        """Nothing flows through the sides of a flat box."""
        grid = self.grid()
        whole = sample_geometry(grid, self.distance, nearest=NEAREST_OF_FILMS)
        if not self.flat:
            return whole
        row = np.arange(grid.cells) // grid.strides[1] % grid.shape[1]
        within = (row == WALL).astype(np.float32)
        along = np.array([[1.0], [0.0], [1.0]], np.float32) * within
        return whole._replace(
            usable=whole.usable * within,
            area=whole.area * along,
            carries=whole.carries * along,
            shut=np.maximum(whole.shut, 1.0 - along),
            wall=whole.wall * along,
            friction=whole.friction * along,
        )

    def fill(self, block: Block, seed: int) -> np.ndarray:
        """Particles of a block of liquid [m], shape (n, 3).

        They lie on a lattice of half a cell, stretched so that a whole number of layers fills the
        block: four in a full cell, in a box that is not flat on every second place.
        """
        lows, highs = (np.array(corner, float) for corner in block)
        if self.flat:
            lows[1], highs[1] = 0.0, self.cell
        counts = np.maximum(np.rint(2.0 * (highs - lows) / self.cell), 1).astype(int)
        if self.flat:
            counts[1] = 1
        at = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
        if not self.flat:
            at = at[at.sum(axis=1) % 2 == 0]
        spacing = (highs - lows) / counts
        jitter = np.random.default_rng(seed).uniform(-JITTER, JITTER, at.shape)
        points = lows + (at + 0.5 + jitter) * spacing
        if self.flat:
            points[:, 1] = 0.5 * self.cell
        off = OFF_WALL * self.cell
        return np.clip(points, off, np.array(self.highest) - off)


def _from_block(block: Block, axes: tuple[int, ...], point: tuple[np.ndarray, ...]) -> np.ndarray:
    """Distance of points from a block, by some of the axes [m]; negative within it."""
    over = [np.maximum(block[0][a] - point[a], point[a] - block[1][a]) for a in axes]
    outside = np.sqrt(sum(np.maximum(one, 0.0) ** 2 for one in over))
    return np.where(outside > 0.0, outside, reduce(np.maximum, over))


@dataclass(frozen=True)
class Body:
    """A liquid before it flows.

    Attributes:
        points: Of its particles [m], shape (n, 3).
        volume: Of the liquid [m³].
        velocity: Of its particles [m/s], shape (n, 3) or (3,).
    """

    points: np.ndarray
    volume: float
    velocity: np.ndarray | Point = (0.0, 0.0, 0.0)


class WetLiquid(NamedTuple):
    """What a liquid is and what pulls at it; SI.

    Attributes:
        viscosity: [Pa s].
        density: [kg/m³].
        tension: Surface tension [N/m].
        angle: Contact angle [rad].
        pull: Acceleration [m/s²].
    """

    viscosity: float
    density: float = 1000.0
    tension: float = 0.0
    angle: float = 0.5 * np.pi
    pull: Point = (0.0, 0.0, -GRAVITY)


Look = Callable[[np.ndarray, np.ndarray], Any]
"""From positions [m] and velocities [m/s] of a liquid's particles, each (n, 3), a number or an
array of one shape. Velocities are half a step older than positions."""


def flow_in_box(
    box: WetBox,
    liquids: Sequence[WetLiquid],
    bodies: Sequence[Body],
    seconds: float,
    look: Look,
    every: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """What one sees of liquids in boxes.

    Args:
        box: The box, the same for all.
        liquids, bodies: What is in each.
        seconds: How long.
        look: What is seen of a liquid.
        every: Steps from one look to the next.

    Returns:
        Times of the looks [s], shape [looks], and what was seen then, shape [looks, B, ...]; NaN
        for a liquid that went wrong.

    Raises:
        ValueError: A box or its liquid is larger than `CELLS` and `PARTICLES` allow.
    Warns:
        FailedSimulation: A liquid went wrong.
    """
    cells, most = box.grid().cells, max(len(body.points) for body in bodies)
    if cells > CELLS or most > PARTICLES:
        raise ValueError(
            f"a box has room for {CELLS} cells and {PARTICLES} particles, got {cells} and "
            f"{most}; take a smaller one or larger cells"
        )
    steps = round(seconds / box.dt / every) * every
    with runtime.LOCK:
        runtime.start()
        from bolfi_liquids.models.apic.lanes import LANES

        filled = list(zip(liquids, bodies, strict=True))
        together = GROUPS * LANES
        found = [
            _seen(box, filled[low : low + together], steps, look, every)
            for low in range(0, len(filled), together)
        ]
    return box.dt * np.arange(every, steps + 1, every), np.concatenate(found, axis=1)


def _seen(
    box: WetBox,
    filled: Sequence[tuple[WetLiquid, Body]],
    steps: int,
    look: Look,
    every: int,
) -> np.ndarray:
    """What one sees of liquids that march together; see `flow_in_box`."""
    liquids, bodies = zip(*filled, strict=True)
    scene, places = _started(box, liquids, bodies)
    seen = []
    for step in range(0, steps, every):
        scene.march(places.groups, step, step + every)
        seen.append(_look(scene, places, bodies, look))
    status = places.gather(scene.status.to_numpy())
    found = np.array(seen, float)
    found[:, faulty(status, np.zeros(len(liquids)))] = np.nan
    return found


def _started(
    box: WetBox, liquids: Sequence[WetLiquid], bodies: Sequence[Body]
) -> tuple[Any, Places]:
    """A scene with its liquids before the first step."""
    from bolfi_liquids.models.apic.lanes import LANES

    places, grid, geometry = Places(len(liquids), GROUPS, LANES), box.grid(), box.geometry()
    scene = _scene()
    scene.enter_vessel(grid, geometry, box.dt)
    scene.enter_surfaces(geometry.usable, np.stack([geometry.wall, geometry.area]))
    scene.lowest[None], scene.highest[None] = (0.0, 0.0, 0.0), box.highest
    low, high = box.block or ((-1.0,) * 3, (-1.0,) * 3)
    if box.flat and box.block:
        low, high = (low[0], -1.0, low[2]), (high[0], 1.0, high[2])
    scene.block_lowest[None], scene.block_highest[None] = low, high
    points, counts = places.spread_points([body.points for body in bodies])
    rows = [
        (
            body.volume / len(body.points) / box.cell**3,
            one.viscosity / one.density,
            one.density,
            grid.origin[2],  # a level below all: no pressure to begin with
        )
        for one, body in zip(liquids, bodies, strict=True)
    ]
    scene.fill_in(points, counts, _spread_columns(places, rows))
    surfaces = [(one.tension / one.density, np.cos(one.angle)) for one in liquids]
    scene.set_surfaces(_spread_columns(places, surfaces))
    starts = [np.broadcast_to(np.asarray(body.velocity), body.points.shape) for body in bodies]
    velocity, _ = places.spread_points(starts)
    scene.drive(places.spread(np.array([one.pull for one in liquids])), velocity)
    return scene, places


def _spread_columns(places: Places, rows: list[tuple[float, ...]]) -> np.ndarray:
    """Numbers of each liquid, by number, group and lane."""
    return np.stack([places.spread(np.array(column)) for column in zip(*rows, strict=True)])


def _look(scene: Any, places: Places, bodies: Sequence[Body], look: Look) -> list[Any]:
    position, velocity = (
        places.gather(field.to_numpy()).astype(float) for field in (scene.position, scene.speed)
    )
    sizes = [len(body.points) for body in bodies]
    return [look(position[k, :n], velocity[k, :n]) for k, n in enumerate(sizes)]


@cache
def _scene() -> Any:
    """Its fields live as long as the process."""
    from .wet_box_scene import WetBoxScene

    return WetBoxScene(GROUPS, CELLS, PARTICLES)
