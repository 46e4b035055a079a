"""Captions of a movie's pictures."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from ..drawing import INK
from .light import Picture

SIZE, MARGIN = 14, 12  # pixels
GREY = "#5b6770"


def written(picture: Picture, top: Sequence[str], bottom: Sequence[str]) -> NDArray[np.uint8]:
    """The picture in bytes, with lines in its upper and its lower left corner."""
    image = Image.fromarray(np.rint(255.0 * np.clip(picture, 0.0, 1.0)).astype(np.uint8))
    draw = ImageDraw.Draw(image)
    low = MARGIN, image.height - MARGIN
    draw.multiline_text((MARGIN, MARGIN), "\n".join(top), INK, font_size=SIZE)
    draw.multiline_text(low, "\n".join(bottom), GREY, anchor="ld", font_size=SIZE - 2)
    return np.asarray(image)
