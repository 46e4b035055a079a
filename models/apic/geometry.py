"""Open shares of cells and faces beside walls, from samples of a signed distance."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from .grid import Grid

Distance = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Of points x, y and z from the nearest wall [m], arrays that broadcast; negative within it."""
Side = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Of points x, y and z: ABOVE, INSIDE or OUTSIDE; of points within a wall, that of its nearer
face."""
Kernel = Callable[[np.ndarray], np.ndarray]
"""Weights of samples by their distance, in cells, from the point of a mean."""

NOWHERE, ABOVE, INSIDE, OUTSIDE = -1, 0, 1, 2
"""Sides of a wall that may be thinner than a cell. Liquid passes between any two but INSIDE and
OUTSIDE, which the rim parts."""

SLIVER = 0.1  # open share below which a cell is closed: liquid would drain into it
LEAST_AREA = 0.02  # open share of a face that carries momentum
LEAST_CAPACITY = 0.02
ON_WALL = 1e-3  # cells from a wall within which a face lies in it
BESIDE = 0.75  # cells from a wall within which a cell's centre is close to it
NEAREST = 0.1  # cells from a wall at which friction is reckoned at least
NEAREST_OF_FILMS = 0.25  # the same of liquids that leave thin films on walls
SAMPLES = 8  # along each edge of a cell
TOGETHER = 4  # layers of cells that are sampled at once

CENTRE = (0.5, 0.5, 0.5)  # of a cell, in cells
FACES = ((0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0))  # centres of its lower ones
EDGES = ((0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5))  # centres of its lowest ones


class Geometry(NamedTuple):
    """Shares of cells, shape (cells,), and of their lower faces, shape (3, cells); float32.

    A cell that a thin wall cuts counts for the side that has more of it.

    Attributes:
        usable: 1 where liquid may be.
        beside: 1 where the centre is close to a wall.
        side: Of the wall: ABOVE, INSIDE or OUTSIDE.
        volume: Open share of the cell.
        capacity: What full liquid deposits into the cell, of a whole cell's.
        area: Open share of the face.
        carries: 1 where the face carries momentum.
        shut: 1 where a wall closes the face.
        face_side: Of the wall, on which the face is.
        wall: Area of wall along which the face's component goes, in cells.
        friction: Area of wall that rubs at the face, in cells, over its distance.
        solid: Share of the box around the face that is wall, weighted as particles deposit.
        edge: Open share of the box around the cell's lowest edge along the axis.
    """

    usable: np.ndarray
    beside: np.ndarray
    side: np.ndarray
    volume: np.ndarray
    capacity: np.ndarray
    area: np.ndarray
    carries: np.ndarray
    shut: np.ndarray
    face_side: np.ndarray
    wall: np.ndarray
    friction: np.ndarray
    solid: np.ndarray
    edge: np.ndarray


def from_cup(radius: float, floor: bool = True) -> Distance:
    """Distance from the wall of an upright cup of `radius` [m], and from its floor at z = 0."""

    def distance(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        side = radius - np.hypot(x, y)
        return np.minimum(side, z) if floor else side

    return distance


def sample_geometry(
    grid: Grid, distance: Distance, side: Side | None = None, nearest: float = NEAREST
) -> Geometry:
    """The geometry of a vessel.

    Cells that are cut by walls follow Batty, Bertails and Bridson (2007), "A fast variational
    framework for accurate solid-fluid coupling"; here the shares are means over samples.

    Args:
        grid: Its cells.
        distance: From the walls.
        side: Of the walls, where liquid is on both sides of them.
        nearest: Cells from a wall at which friction is reckoned at least.
    """
    inner = grid.inner()
    kinds = (ABOVE,) if side is None else (ABOVE, INSIDE, OUTSIDE)
    volumes, capacities = np.zeros((2, len(kinds), grid.cells))
    deposit, edge = np.zeros((2, 3, grid.cells))
    walls = np.zeros((len(kinds), 2, 3, grid.cells))
    for layers in _samples(grid, distance, side):
        cells = layers.cells
        for kind in kinds:
            here = ((layers.side == kind) & layers.is_open).astype(np.float32)
            volumes[kind, cells] = _means(here, _box, CENTRE)
            capacities[kind, cells] = _means(here, _hat, CENTRE)
        is_open = layers.is_open.astype(np.float32)
        for axis in range(3):
            deposit[axis, cells] = _means(is_open, _hat, FACES[axis])
            edge[axis, cells] = _means(is_open, _box, EDGES[axis])
            for kind in kinds:
                for what in range(2):
                    area = layers.wall[what, axis] * (layers.side == kind)
                    walls[kind, what, axis, cells] = _means(area, _box, FACES[axis])
    own = np.argmax(volumes, axis=0)
    volume = np.choose(own, volumes)
    capacity = sum(np.where(_joined(own, kind), capacities[kind], 0.0) for kind in kinds)
    below = [np.roll(own, stride) for stride in grid.strides]
    area = np.stack([_open_faces(grid, distance, side, a, (below[a], own)) for a in range(3)])
    sliver = inner & (volume <= SLIVER)
    for axis, stride in enumerate(grid.strides):
        area[axis, sliver] = 0.0
        area[axis, stride:][sliver[:-stride]] = 0.0
    carries = inner & (area > LEAST_AREA)
    face_side = np.maximum(own, below)
    wall, rubbing = (
        _by_side(grid, distance, walls[:, what], carries, face_side) for what in range(2)
    )
    away = np.stack([distance(*grid.faces(axis).T) / grid.cell for axis in range(3)])
    fields = (
        inner & ~sliver,
        distance(*grid.points(CENTRE).T) < BESIDE * grid.cell,
        own,
        volume,
        np.maximum(capacity, LEAST_CAPACITY),
        area * inner,
        carries,
        inner & ~carries,
        face_side,
        wall,
        rubbing / np.maximum(away, nearest),
        1.0 - deposit,
        edge,
    )
    return Geometry(*(np.ascontiguousarray(field, np.float32) for field in fields))


def _joined(one: np.ndarray, other: np.ndarray | int) -> np.ndarray:
    """Whether liquid passes between two sides."""
    return (one == other) | (one == ABOVE) | (np.asarray(other) == ABOVE)


class _Layers(NamedTuple):
    """Samples of a few layers of cells, of shape (z, y, x).

    Attributes:
        cells: Of the layers.
        is_open: Whether they are outside of walls.
        side: Of the wall, where they are.
        wall: How much wall each stands for, in cells: along each axis, and times `_rub`; shape
            (2, 3, z, y, x).
    """

    cells: slice
    is_open: np.ndarray
    side: np.ndarray
    wall: np.ndarray


def _sides(side: Side | None, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Sides of the wall on which a lattice's points lie, shape (z, y, x)."""
    where = ABOVE if side is None else side(x, y[:, None], z[:, None, None])
    return np.broadcast_to(where, (len(z), len(y), len(x))).astype(np.int8)


def _samples(grid: Grid, distance: Distance, side: Side | None) -> Iterator[_Layers]:
    """All samples, layer by layer."""
    x, y, z = (_along(grid, axis) for axis in range(3))
    for low in range(0, grid.shape[2], TOGETHER):
        high = min(low + TOGETHER, grid.shape[2])
        layers = z[low * SAMPLES : (high + 2) * SAMPLES]
        away = _distances(distance, x, y, layers) * (SAMPLES / grid.cell)
        at = np.stack(np.nonzero(np.abs(away) < np.sqrt(3.0)))
        k, j, i = at
        normal = _normal(grid, distance, np.stack([x[i], y[j], layers[k]]))
        stands_for = SAMPLES * _wall_at(away[k, j, i], normal)
        if side is not None:
            at = _before_wall(at, away[k, j, i], normal, away.shape)
        where = np.ravel_multi_index(tuple(at), away.shape)
        shares = np.concatenate([1.0 - normal**2, _rub(normal**2)])
        wall = np.empty((2, 3, *away.shape), np.float32)
        for of_share, share in zip(wall.reshape(6, -1), shares, strict=True):
            of_share[:] = np.bincount(where, stands_for * share, away.size)
        yield _Layers(
            slice(low * grid.strides[2], high * grid.strides[2]),
            away > 0.0,
            _sides(side, x, y, layers),
            wall,
        )


def _before_wall(
    at: np.ndarray, away: np.ndarray, normal: np.ndarray, shape: tuple[int, ...]
) -> np.ndarray:
    """Samples (z, y, x) of a lattice, those within a wall mirrored in it.

    Their wall would belong to cells behind it otherwise, and where it is thinner than a cell there
    is other liquid.
    """
    inside = 2.0 * np.maximum(-away, 0.0)
    mirrored = at + np.rint(inside * normal[::-1]).astype(int)
    return np.clip(mirrored, 0, np.array(shape)[:, None] - 1)


def _along(grid: Grid, axis: int) -> np.ndarray:
    """Samples along an axis [m], from one cell before the box to one behind it."""
    at = (np.arange((grid.shape[axis] + 2) * SAMPLES) + 0.5) / SAMPLES - 1.0
    return grid.origin[axis] + grid.cell * at


def _distances(distance: Distance, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Signed distances of a lattice's points, shape (z, y, x)."""
    away = distance(x, y[:, None], z[:, None, None])
    return np.broadcast_to(away, (len(z), len(y), len(x)))


def _wall_at(away: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """A delta function of the distance from the wall, in samples.

    A hat as wide as the sum of |n| is exact for flat walls (Engquist, Tornberg and Tsai 2005,
    "Discretization of Dirac delta functions in level set methods").
    """
    width = np.maximum(np.abs(normal).sum(axis=0), 1e-20)
    return np.maximum(1.0 - np.abs(away) / width, 0.0) / width


def _box(off: np.ndarray) -> np.ndarray:
    return np.abs(off) < 0.5


def _hat(off: np.ndarray) -> np.ndarray:
    """The kernel by which particles deposit."""
    return np.maximum(1.0 - np.abs(off), 0.0)


def _means(samples: np.ndarray, kernel: Kernel, at: tuple[float, ...]) -> np.ndarray:
    """Means around a point of each cell, in their order; samples reach a cell further."""
    for axis in (2, 1, 0):  # x at last: its samples are neighbours in memory
        samples = _means_along(samples, kernel, at, axis)
    return samples.ravel()


def _means_along(
    samples: np.ndarray, kernel: Kernel, at: tuple[float, ...], axis: int
) -> np.ndarray:
    along = np.moveaxis(samples, 2 - axis, 0)
    cells = len(along) // SAMPLES - 2
    weights = kernel((np.arange(2 * SAMPLES) + 0.5) / SAMPLES - 1.0).astype(np.float32) / SAMPLES
    first = round(at[axis] * SAMPLES)
    found = sum(
        weight * along[first + n : first + n + cells * SAMPLES : SAMPLES]
        for n, weight in enumerate(weights)
        if weight > 0.0
    )
    return np.moveaxis(np.asarray(found), 0, 2 - axis)


def _open_faces(
    grid: Grid,
    distance: Distance,
    side: Side | None,
    axis: int,
    cells: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Open share of each cell's lower face along an axis, shape (cells,).

    `cells` are the sides of the cells below and above it.
    """
    x, y, z = (
        grid.origin[a] + grid.cell * np.arange(grid.shape[a]) if a == axis else _along(grid, a)
        for a in range(3)
    )
    is_open = _distances(distance, x, y, z) > ON_WALL * grid.cell
    sides = _sides(side, x, y, z - ON_WALL * grid.cell)  # what is at the rim is below it
    joins = np.where(_joined(*cells), np.maximum(*cells), NOWHERE)
    open_share = np.zeros(grid.cells)
    for kind in np.unique(joins[joins != NOWHERE]):
        share = ((sides == kind) & is_open).astype(np.float32)
        for other in {0, 1, 2} - {axis}:
            share = _means_along(share, _box, CENTRE, other)
        open_share += np.where(joins == kind, share.ravel(), 0.0)
    return open_share


def _normal(grid: Grid, distance: Distance, points: np.ndarray) -> np.ndarray:
    """Unit vectors away from the wall, at points (3, n); 0 halfway between walls."""
    beside = 0.02 * grid.cell * np.eye(3)[:, :, None]
    slope = np.stack([distance(*(points + e)) - distance(*(points - e)) for e in beside])
    return slope / np.maximum(np.linalg.norm(slope, axis=0), 1e-20)


def _rub(squared: np.ndarray) -> np.ndarray:
    """Friction factor of a wall for the component along an axis, from its normal's n² there.

    A wall holds what flows along it and lets go what flows off. Each component has a coefficient
    of its own; these make the power of any flow around or along a cylinder that of its speed:
    (1 - n²) alone rubs a quarter too little on a round wall.
    """
    along = 1.0 - squared
    return along / (along**2 + squared**2)


def _by_side(
    grid: Grid, distance: Distance, walls: np.ndarray, carries: np.ndarray, face_side: np.ndarray
) -> np.ndarray:
    """Area of wall at the faces, shape (3, cells), from that on each side, (sides, 3, cells)."""
    area = np.zeros(face_side.shape)
    for kind, axis in np.ndindex(walls.shape[:2]):
        of_side = carries[axis] & _joined(face_side[axis], kind)
        area[axis] += _moved_inward(grid, distance, axis, walls[kind, axis], of_side)
    return area


def _moved_inward(
    grid: Grid, distance: Distance, axis: int, wall: np.ndarray, carries: np.ndarray
) -> np.ndarray:
    """Area of wall at the faces along an axis.

    That of a face that carries no momentum counts at its neighbours away from the wall instead, or
    behind it where a thin wall's other side is nearer. At the corner of the floor none may carry:
    cups of less than 3 cm in radius lose 3 to 5 % of what rubs vertically.
    """
    area, faces = np.where(carries, wall, 0.0), grid.faces(axis).T
    lost = np.flatnonzero((wall > 0.0) & ~carries & grid.inner())
    normal = _normal(grid, distance, faces[:, lost])
    steps = np.array(grid.strides)[:, None] * np.sign(normal).astype(int)
    inward, behind = (np.clip(lost + way * steps, 0, grid.cells - 1) for way in (1, -1))
    none = ~(normal**2 * carries[inward]).any(axis=0)
    inward[:, none] = behind[:, none]
    weight = normal**2 * carries[inward]
    weight /= np.maximum(weight.sum(axis=0), 1e-20)
    np.add.at(area, inward, weight * wall[lost])
    return area
