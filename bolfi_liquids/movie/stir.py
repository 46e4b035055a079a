"""Pictures of a stir."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .rendering import (
    Glass,
    OrthographicView,
    drawn,
    glass_before,
    glass_behind,
    room,
    stick_layer,
    surface,
    through_liquid,
    written,
)

if TYPE_CHECKING:
    from ..models import StirFrames, StirSetup

PICTURE_SIZE = 640, 480
AZIMUTH, ELEVATION = np.radians(25.0), np.radians(22.0)


def stir_view(setup: "StirSetup", share: float = 1.0) -> OrthographicView:
    """A camera that sees the cup, and the stick's lower half; `share` of `PICTURE_SIZE` wide."""
    width, height = (round(share * pixels) for pixels in PICTURE_SIZE)
    tall = setup.cup.height + 0.9 * setup.cup.radius
    scale = height / (1.3 * tall + 2.0 * setup.cup.radius * np.sin(ELEVATION))
    centre = 0.0, 0.0, tall / 2.0
    return OrthographicView(width, height, float(scale), centre, AZIMUTH, ELEVATION)


def stir_pictures(
    frames: "StirFrames", setup: "StirSetup", caption: Sequence[str], share: float = 1.0
) -> Iterator[NDArray[np.uint8]]:
    """A picture of each frame, of shape [height, width, 3].

    Args:
        frames: Of `models.stir_frames`.
        setup: That they were made with.
        caption: Lines for a corner, beside the time.
        share: Of `PICTURE_SIZE`.
    """
    view, cup = stir_view(setup, share), setup.cup
    glass = Glass(cup.radius, cup.height, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    empty = drawn(view, room(view, [glass]), glass_behind(glass, view))
    before = glass_before(glass, view)
    for time, position, pivot, tip in zip(
        frames.time, frames.position, frames.pivot, frames.tip, strict=True
    ):
        stick = stick_layer(view, pivot, tip, setup.stick.radius)
        liquid = surface(view, position, setup.spacing, glass)
        picture = drawn(view, through_liquid(empty, liquid, stick), before)
        angle = np.degrees(np.arctan2((tip - pivot)[:2], (pivot - tip)[2]))
        lines = [f"{time:.2f} s", f"stick {angle[0]:+.1f}° in xz, {angle[1]:+.1f}° in yz"]
        yield written(picture, lines, caption)
