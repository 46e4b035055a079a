"""What walls leave open of each cell and face, from samples of a signed distance."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .grid import Grid

Distance = Callable[[np.ndarray], np.ndarray]
"""Distance of points (n, 3) from the nearest wall [m], negative within it."""

SLIVER = 0.1  # open share below which a cell is closed: liquid would drain into it
LEAST_AREA = 0.02  # open share of a face that carries momentum
LEAST_CAPACITY = 0.02
ON_WALL = 1e-3  # cells from a wall within which a face lies in it
NEAREST = 0.1  # cells from a wall at which friction is reckoned at least
SAMPLES, WALL_SAMPLES = 8, 10  # along each edge


class Geometry(NamedTuple):
    """Shares of cells, shape (cells,), and of their lower faces, shape (3, cells); float32.

    Attributes:
        usable: 1 where liquid may be.
        volume: Open share of the cell.
        capacity: What full liquid deposits into the cell, of a whole cell's.
        area: Open share of the face.
        carries: 1 where the face carries momentum.
        shut: 1 where a wall closes the face.
        friction: Area of wall that rubs at the face over its distance, in cells.
        solid: Share of the box around the face that is wall, weighted as particles deposit.
        edge: Open share of the box around the cell's lowest edge along the axis.
    """

    usable: np.ndarray
    volume: np.ndarray
    capacity: np.ndarray
    area: np.ndarray
    carries: np.ndarray
    shut: np.ndarray
    friction: np.ndarray
    solid: np.ndarray
    edge: np.ndarray


def from_cup(radius: float, floor: bool = True) -> Distance:
    """Distance from the wall of an upright cup of `radius` [m], and from its floor at z = 0."""

    def distance(points: np.ndarray) -> np.ndarray:
        side = radius - np.hypot(points[:, 0], points[:, 1])
        return np.minimum(side, points[:, 2]) if floor else side

    return distance


def sample_geometry(grid: Grid, distance: Distance) -> Geometry:
    """The geometry of a vessel.

    Cells that are cut by walls follow Batty, Bertails and Bridson (2007), "A fast variational
    framework for accurate solid-fluid coupling"; here the shares are means over samples.
    """
    inner, centres = grid.inner(), grid.centres
    even = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    wide = 2.0 * even
    weights = 1.0 - np.abs(wide)
    box = _offsets(even, even, even)
    hat, hat_weights = _offsets(wide, wide, wide), _products(weights, weights, weights)

    volume = _share(grid, distance, centres, box)
    capacity = _share(grid, distance, centres, hat, hat_weights)
    sliver = inner & (volume <= SLIVER)
    usable = inner & ~sliver
    area, rubbing, solid, edge = (np.zeros((3, grid.cells)) for _ in range(4))
    for axis, stride in enumerate(grid.strides):
        flat = [np.zeros(1) if a == axis else even for a in range(3)]
        faces = grid.faces(axis)
        open_face = _share(grid, distance, faces, _offsets(*flat), least=ON_WALL)
        open_face[sliver] = 0.0
        open_face[stride:][sliver[:-stride]] = 0.0
        area[axis] = open_face
        solid[axis] = 1.0 - _share(grid, distance, faces, hat, hat_weights)
        rubbing[axis] = _wall_area(grid, distance, faces, axis)
        at_edge = tuple(0.5 if axis == a else 0.0 for a in range(3))
        edge[axis] = _share(grid, distance, grid.points(at_edge), box)
    carries = inner & (area > LEAST_AREA)
    friction = np.stack(
        [_friction(grid, distance, axis, rubbing[axis], carries[axis]) for axis in range(3)]
    )
    fields = (
        usable,
        volume,
        np.maximum(capacity, LEAST_CAPACITY),
        area * inner,
        carries,
        inner & ~carries,
        friction,
        solid,
        edge,
    )
    return Geometry(*(np.ascontiguousarray(field, np.float32) for field in fields))


def _offsets(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """All triples, shape (n, 3)."""
    return np.stack([one.ravel() for one in np.meshgrid(x, y, z, indexing="ij")], axis=1)


def _products(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return _offsets(x, y, z).prod(axis=1)


def _share(
    grid: Grid,
    distance: Distance,
    points: np.ndarray,
    offsets: np.ndarray,
    weights: np.ndarray | None = None,
    least: float = 0.0,
) -> np.ndarray:
    """Weighted share of the samples around each point that are open, `least` cells from a wall."""
    reach = np.linalg.norm(offsets, axis=1).max() + least
    at = distance(points) / grid.cell
    share = np.where(at > least, 1.0, 0.0)
    for near in _slices(np.flatnonzero(np.abs(at) < reach)):
        samples = points[near, None, :] + grid.cell * offsets
        is_open = distance(samples.reshape(-1, 3)) > least * grid.cell
        is_open = is_open.reshape(len(near), -1)
        share[near] = np.average(is_open, axis=1, weights=weights)
    return share


def _wall_area(grid: Grid, distance: Distance, faces: np.ndarray, axis: int) -> np.ndarray:
    """Wall in the box around each face, in squares of a cell, times `_rub` of its normal."""
    even = (np.arange(WALL_SAMPLES) + 0.5) / WALL_SAMPLES - 0.5
    offsets = grid.cell * _offsets(even, even, even)
    shell, step = 0.2, 0.02  # of a cell: samples so near to the wall stand for it
    found = np.zeros(grid.cells)
    for near in _slices(np.flatnonzero(np.abs(distance(faces)) < 1.2 * grid.cell)):
        samples = (faces[near, None, :] + offsets).reshape(-1, 3)
        away = distance(samples) / grid.cell
        on_wall = np.flatnonzero((away > 0.0) & (away < shell))
        beside = step * grid.cell * np.eye(3)
        slope = np.stack(
            [distance(samples[on_wall] + e) - distance(samples[on_wall] - e) for e in beside]
        )
        squared = slope[axis] ** 2 / np.maximum((slope**2).sum(axis=0), 1e-20)
        rubs = np.zeros(len(samples))
        rubs[on_wall] = _rub(squared)
        found[near] = rubs.reshape(len(near), -1).mean(axis=1) / shell
    return found


def _rub(squared: np.ndarray) -> np.ndarray:
    """How much a wall rubs at the component along an axis, from its normal n's n² there.

    A wall holds what flows along it and lets go what flows off. Each component has a coefficient
    of its own; these make the power of any flow around or along a cylinder that of its speed:
    (1 - n²) alone rubs a quarter too little on a round wall.
    """
    along = 1.0 - squared
    return along / (along**2 + squared**2)


def _friction(
    grid: Grid, distance: Distance, axis: int, rubbing: np.ndarray, carries: np.ndarray
) -> np.ndarray:
    """Rubbing area of the faces along an axis over their distance from the wall.

    What rubs at a face that carries no momentum rubs at its neighbours away from the wall instead.
    """
    area, faces = np.where(carries, rubbing, 0.0), grid.faces(axis)
    lost = np.flatnonzero((rubbing > 0.0) & ~carries)
    beside = 0.02 * grid.cell * np.eye(3)
    slope = np.stack([distance(faces[lost] + e) - distance(faces[lost] - e) for e in beside])
    steps = np.array(grid.strides)[:, None] * np.sign(slope).astype(int)
    inward = np.clip(lost + steps, 0, grid.cells - 1)
    weight = slope**2 * carries[inward]
    weight /= np.maximum(weight.sum(axis=0), 1e-20)
    np.add.at(area, inward, weight * rubbing[lost])
    return area / np.maximum(distance(faces) / grid.cell, NEAREST)


def _slices(which: np.ndarray, most: int = 512) -> list[np.ndarray]:
    """Parts of at most so many, so that samples stay in the cache."""
    return [which[low : low + most] for low in range(0, len(which), most)]
