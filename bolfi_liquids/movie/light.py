"""Light on and through the liquid: absorption, scattering and reflection."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .surface import VisibleSurface
from .view import OrthographicView

Picture = NDArray[np.floating]
"""Red, green and blue from 0 to 1, shape [height, width, 3]."""

ABSORPTION = np.array([62.0, 21.0, 7.0], np.float32)  # 1/m: a blue dye, so that depth is seen
SCATTERED_COLOUR = np.array([0.36, 0.62, 0.86], np.float32)
SCATTERING = 8.0  # 1/m
SKY, GROUND = np.array([1.0, 1.0, 1.0], np.float32), np.array([0.62, 0.68, 0.74], np.float32)
LAMP_DIRECTION = np.array([-0.45, 0.72, 0.53], np.float32)
SHININESS = 60.0
LEAST_REFLECTED = 0.03  # share at normal incidence


class Layer(NamedTuple):
    """Something solid: its colour, where it is, and how near.

    Attributes:
        colour: Shape [height, width, 3].
        cover: Share of each pixel, shape [height, width].
        front: Towards the camera [m], shape [height, width].
    """

    colour: Picture
    cover: NDArray[np.float32]
    front: NDArray[np.float32]

    @classmethod
    def empty(cls, view: OrthographicView) -> "Layer":
        """Nothing, of a picture's size."""
        size = view.height, view.width
        return cls(*(np.zeros(shape, np.float32) for shape in ((*size, 3), size, size)))


def over(below: Picture, colour: Picture, cover: NDArray) -> Picture:
    """`colour` laid over a picture where it covers it."""
    return below + cover[..., None] * (colour - below)


def through_liquid(
    behind: Picture, liquid: VisibleSurface | None, stick: Layer | None = None
) -> Picture:
    """The picture with the liquid in it, and a stick that dips into it.

    Args:
        behind: What is there besides.
        liquid: None if none is seen.
        stick: Seen through half of the liquid where it is behind the surface.
    """
    base = behind if stick is None else over(behind, stick.colour, stick.cover)
    if liquid is None:
        return base
    part, depth = liquid.window, liquid.thickness[..., None]
    passed = behind[part] * np.exp(-ABSORPTION * depth)
    if stick is not None:
        dyed = stick.colour[part] * np.exp(-ABSORPTION * depth / 2.0)
        passed = over(passed, dyed, stick.cover[part])
    passed += SCATTERED_COLOUR * (1.0 - np.exp(-SCATTERING * depth))
    picture = base.copy()
    lit = over(base[part], _lit(passed, liquid.normal), liquid.cover)
    if stick is not None:
        nearer = stick.cover[part] * (stick.front[part] > liquid.front)
        lit = over(lit, stick.colour[part], nearer)
    picture[part] = lit
    return picture


def _lit(passed: Picture, normal: NDArray) -> Picture:
    """Light that has passed the liquid, with the reflection of its surface (Schlick 1994)."""
    up, facing = normal[..., 1:2], np.clip(normal[..., 2:3], 0.0, 1.0)
    reflected = LEAST_REFLECTED + (1.0 - LEAST_REFLECTED) * (1.0 - facing) ** 5
    mirrored = GROUND + (0.5 + 0.5 * up) * (SKY - GROUND)
    halfway = LAMP_DIRECTION / np.linalg.norm(LAMP_DIRECTION) + np.array(
        [0.0, 0.0, 1.0], np.float32
    )
    halfway /= np.linalg.norm(halfway)
    glint = np.clip(normal @ halfway, 0.0, 1.0)[..., None] ** SHININESS
    lit = passed * (0.82 + 0.18 * up) + 0.7 * reflected * (mirrored - passed) + 0.55 * glint
    return np.clip(lit, 0.0, 1.0)
