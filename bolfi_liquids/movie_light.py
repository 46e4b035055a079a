"""Light on and through the liquid: what it takes away, bends, and throws back."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .movie_surface import Surface
from .movie_view import View

Picture = NDArray[np.float32]
"""Red, green and blue from 0 to 1, shape [height, width, 3]."""

ABSORBED = np.array([62.0, 21.0, 7.0], np.float32)  # 1/m: a blue dye, so that depth is seen
SCATTERED = np.array([0.36, 0.62, 0.86], np.float32)
SCATTER = 8.0  # 1/m
BEND = 0.35  # displacement of what is behind, by the thickness
DEEPEST = 0.02  # m of liquid that bend
SKY, GROUND = np.array([1.0, 1.0, 1.0], np.float32), np.array([0.62, 0.68, 0.74], np.float32)
LAMP = np.array([-0.45, 0.72, 0.53], np.float32)
SHINE = 60.0
LEAST_REFLECTED = 0.03  # of what meets the surface head on


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


def over(below: Picture, colour: Picture, cover: NDArray) -> Picture:
    """`colour` laid over a picture where it covers it."""
    return below + cover[..., None] * (colour - below)


def through_liquid(view: View, behind: Picture, liquid: Surface | None, stick: Layer | None = None):
    """The picture with the liquid in it, and a stick that dips into it.

    Args:
        view: The camera.
        behind: What is there besides.
        liquid: None if none is seen.
        stick: Seen through half of the liquid where it is behind the surface.
    """
    if liquid is None:
        return behind if stick is None else over(behind, stick.colour, stick.cover)
    bend = BEND * view.scale * np.minimum(liquid.thickness, DEEPEST) * liquid.cover
    rows, columns = np.indices(liquid.cover.shape, np.float32)
    # towards the thicker side, as a lens does
    shifted = rows + bend * liquid.normal[..., 1], columns - bend * liquid.normal[..., 0]
    rows, columns = (
        np.rint(np.clip(at, 0, size - 1)).astype(int)
        for at, size in zip(shifted, liquid.cover.shape, strict=True)
    )

    depth = liquid.thickness[..., None]
    passed = behind[rows, columns] * np.exp(-ABSORBED * depth)
    if stick is not None:
        dyed = stick.colour[rows, columns] * np.exp(-ABSORBED * depth / 2.0)
        passed = over(passed, dyed, stick.cover[rows, columns])
    passed += SCATTERED * (1.0 - np.exp(-SCATTER * depth))

    up, facing = liquid.normal[..., 1:2], np.clip(liquid.normal[..., 2:3], 0.0, 1.0)
    reflected = LEAST_REFLECTED + (1.0 - LEAST_REFLECTED) * (1.0 - facing) ** 5
    mirrored = GROUND + (0.5 + 0.5 * up) * (SKY - GROUND)
    halfway = LAMP / np.linalg.norm(LAMP) + np.array([0.0, 0.0, 1.0], np.float32)
    halfway /= np.linalg.norm(halfway)
    glint = np.clip(liquid.normal @ halfway, 0.0, 1.0)[..., None] ** SHINE
    lit = passed * (0.82 + 0.18 * up) + 0.7 * reflected * (mirrored - passed) + 0.55 * glint
    base = behind if stick is None else over(behind, stick.colour, stick.cover)
    picture = over(base, np.clip(lit, 0.0, 1.0), liquid.cover)
    if stick is not None:
        nearer = stick.cover * (stick.front > liquid.front)
        picture = over(picture, stick.colour, nearer)
    return picture
