"""Surfaces in the liquid as points that hold it to their velocity.

Direct forcing (Uhlmann 2005, J. Comput. Phys. 209, 448), corrected several times a step. Each point
keeps its force from step to step, so that a long step of a viscous liquid leaves no slip.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .box import VERTICAL, Box, Velocity

REACH = 1  # cells to either side of the nearest one that a point acts on


class Stencil(NamedTuple):
    """Faces around n points and their weights, for each component of the velocity.

    Attributes:
        faces: Flat indices into the component, shape [n, 27] each.
        weights: Shape [n, 27] each.
    """

    faces: tuple[NDArray[np.intp], ...]
    weights: tuple[NDArray[np.float64], ...]


class Surface(NamedTuple):
    """n points of a surface, where they are at one moment.

    Attributes:
        stencil: What they act on.
        share: Part of each point that is in the liquid, shape [n].
        volume: Of liquid that each point moves [m³], shape [n].
        velocity: Of the surface [m/s], shape [n, 3].
        force: On the liquid per mass [m/s²], shape [n, 3].
    """

    stencil: Stencil
    share: NDArray[np.float64]
    volume: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]


def smoothed_delta(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weight of a node at a distance in cells; 0 from 1.5 on.

    Roma, Peskin & Berger 1999 (J. Comput. Phys. 153, 509).
    """
    r = np.abs(distance)
    near = (1.0 + np.sqrt(np.maximum(1.0 - 3.0 * r**2, 0.0))) / 3.0
    far = (5.0 - 3.0 * r - np.sqrt(np.maximum(1.0 - 3.0 * (1.0 - r) ** 2, 0.0))) / 6.0
    return np.where(r < 0.5, near, np.where(r < 1.5, far, 0.0))


def stencil(box: Box, points: NDArray[np.float64], share: NDArray[np.float64]) -> Stencil:
    """What points at `points` [m], shape [n, 3], act on, each in proportion to its share [n]."""
    found = [_around(box, component, points, share) for component in range(3)]
    return Stencil(tuple(faces for faces, _ in found), tuple(weights for _, weights in found))


def _around(
    box: Box, component: int, points: NDArray[np.float64], share: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    count = box.faces(component)
    place = (points - box.first_face(component)) / box.cell
    nodes = np.rint(place).astype(np.intp)[:, :, None] + np.arange(-REACH, REACH + 1)
    weights = smoothed_delta(nodes - place[:, :, None])
    if component != VERTICAL:
        nodes[:, VERTICAL] = _mirrored(nodes[:, VERTICAL], count[VERTICAL], box.floor_holds)
    top = np.array(count)[:, None]
    weights = np.where((nodes >= 0) & (nodes < top), weights, 0.0)
    x, y, z = np.clip(nodes, 0, top - 1).transpose(1, 0, 2)
    faces = (x[:, :, None, None] * count[1] + y[:, None, :, None]) * count[2] + z[:, None, None, :]
    in_x, in_y, in_z = weights.transpose(1, 0, 2)
    product = in_x[:, :, None, None] * in_y[:, None, :, None] * in_z[:, None, None, :]
    n = len(points)
    return faces.reshape(n, -1), product.reshape(n, -1) * share[:, None]


def _mirrored(layers: NDArray[np.intp], count: int, floor_holds: bool) -> NDArray[np.intp]:
    """Layers beyond a wall that slips are those before it."""
    below = np.where(layers >= count, 2 * count - 1 - layers, layers)
    return below if floor_holds else np.where(below < 0, -1 - below, below)


def seen(velocity: Velocity, at: Stencil) -> NDArray[np.float64]:
    """Velocity around points, times their share [m/s], shape [n, 3]."""
    pairs = zip(velocity, at.faces, at.weights, strict=True)
    return np.stack([(q.ravel()[faces] * weights).sum(1) for q, faces, weights in pairs], 1)


def pushed(box: Box, velocity: Velocity, surface: Surface, change: NDArray[np.float64]) -> Velocity:
    """Velocity after each point has changed that of its own volume by `change` [m/s], [n, 3]."""
    spread = change * (surface.volume / box.cell**3)[:, None]

    def more(component: int) -> NDArray[np.float64]:
        at, values = surface.stencil, velocity[component]
        each = at.weights[component] * spread[:, component, None]
        added = np.bincount(at.faces[component].ravel(), each.ravel(), values.size)
        return values + added.reshape(values.shape)

    return more(0), more(1), more(2)


def pull(surface: Surface, density: float) -> NDArray[np.float64]:
    """Force of the liquid on each point [N], shape [n, 3]."""
    return -density * surface.force * (surface.volume * surface.share)[:, None]
