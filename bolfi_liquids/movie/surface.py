"""From particles to the surface of the liquid, as a camera sees it.

All of it is computed in the picture's own pixels (van der Laan, Green and Sainz 2009): no grid in
space, no mesh. A picture of 4000 particles, 640 pixels wide, takes 25 ms of processor time.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, grey_dilation

from .view import OrthographicView, window

DROP_RADIUS = (3.0 / (4.0 * np.pi)) ** (1.0 / 3.0)  # of a particle's volume, by the spacing
BRIDGED = 0.8  # from each of two drops [spacing]: the liquid between nearer ones is whole
SMOOTHED = 0.7  # sd by which surface and thickness are smoothed [spacing]


@dataclass(frozen=True)
class Glass:
    """A cup that holds particles: an open cylinder.

    Attributes:
        radius, height: Inner ones [m].
        floor: Centre of its floor in the scene [m], shape [3].
        axis: Unit vector from there to the opening, shape [3].
    """

    radius: float
    height: float
    floor: NDArray
    axis: NDArray

    def clear_of_walls(self, points: NDArray, distance: float) -> NDArray[np.float64]:
        """Points [n, 3]; those in the cup are moved to be this far [m] from side and floor."""
        offset = points - self.floor
        along = offset @ self.axis
        across = offset - along[:, None] * self.axis
        from_axis = np.linalg.norm(across, axis=1)
        inside = (from_axis < self.radius) & (along > 0.0) & (along < self.height)
        inwards = np.minimum((self.radius - distance) / np.maximum(from_axis, 1e-9), 1.0)
        up = np.maximum(along, distance)
        moved = self.floor + inwards[:, None] * across + up[:, None] * self.axis
        return np.where(inside[:, None], moved, points)


class VisibleSurface(NamedTuple):
    """What the pixels of a window of the picture show of the liquid.

    Attributes:
        window: Rows and columns of the picture.
        cover: Share of the pixel behind the liquid, 0 to 1, shape [rows, columns].
        front: How far towards the camera the surface is [m], of the view's centre.
        normal: Of the surface, [rows, columns, 3]: right, up and towards the camera.
        thickness: Of the liquid along the line of sight [m].
    """

    window: tuple[slice, slice]
    cover: NDArray
    front: NDArray
    normal: NDArray
    thickness: NDArray


def surface(
    view: OrthographicView, points: NDArray, spacing: float, glass: Glass
) -> VisibleSurface | None:
    """The liquid's surface.

    Each particle is a drop of its own volume. Drops are blown up until they meet, and the whole
    shrinks by as much again: liquid that is together is smooth, and a single drop keeps its size.

    Args:
        view: The camera.
        points: Particles in the scene [m], shape [n, 3].
        spacing: Between them [m].
        glass: The cup that may hold them; its walls end the liquid.

    Returns:
        None if no point is in the picture.
    """
    drop, shrunk = DROP_RADIUS * spacing, BRIDGED * spacing
    blown, pixels = drop + shrunk, view.scale * spacing
    clear = glass.clear_of_walls(points, drop)
    places, reach = view.pixels(clear), int(np.ceil(view.scale * blown)) + 1
    column, row = np.rint(places).astype(int).T
    seen = (column >= 0) & (column < view.width) & (row >= 0) & (row < view.height)
    if not seen.any():
        return None
    part = window(view, places[seen], reach)
    at = row[seen] - part[0].start, column[seen] - part[1].start
    shape = part[0].stop - part[0].start, part[1].stop - part[1].start

    nearest, count = np.full(shape, -np.inf), np.zeros(shape)
    np.maximum.at(nearest, at, view.camera(clear[seen])[:, 2])
    np.add.at(count, at, 1.0)
    whole = _distance_to(~np.isinf(nearest)) < view.scale * blown
    cover = np.clip(_distance_to(~whole) - view.scale * shrunk, 0.0, 1.0)
    # a paraboloid on top of each particle, which two passes along the axes make
    bulge = -((np.arange(-reach, reach + 1) / view.scale) ** 2) / (2.0 * blown)
    for kernel in (bulge[:, None], bulge[None, :]):
        nearest = grey_dilation(nearest, structure=kernel, mode="constant", cval=-np.inf)
    front = _smoothed(np.where(whole, nearest + drop, 0.0), whole, SMOOTHED * pixels)
    down, right = np.gradient(front, 1.0 / view.scale)
    normal = np.stack([-right, down, np.ones(shape)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    together = spacing * pixels**2 * gaussian_filter(count, SMOOTHED * pixels)
    thickness = np.maximum(together, 2.0 * drop)
    return VisibleSurface(part, cover, front, normal, thickness)


def _distance_to(some: NDArray) -> NDArray:
    """Of each pixel to the nearest of some, in pixels."""
    return np.asarray(distance_transform_edt(~some))


def _smoothed(values: NDArray, known: NDArray, sd: float) -> NDArray:
    """Values smoothed over the pixels in which they are known."""
    share = gaussian_filter(known.astype(float), sd)
    return gaussian_filter(values, sd) / np.maximum(share, 1e-6)
