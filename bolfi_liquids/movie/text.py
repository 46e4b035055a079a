"""Captions of a movie's pictures."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from ..drawing import INK
from .light import Picture

SIZE, MARGIN = 14, 12  # pixels
GREY = "#5b6770"


@cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    import matplotlib

    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf", size)


def written(picture: Picture, top: Sequence[str], bottom: Sequence[str]) -> NDArray[np.uint8]:
    """The picture in bytes, with lines in its upper and its lower left corner."""
    image = Image.fromarray(np.rint(255.0 * np.clip(picture, 0.0, 1.0)).astype(np.uint8))
    draw = ImageDraw.Draw(image)
    draw.multiline_text((MARGIN, MARGIN), "\n".join(top), INK, _font(SIZE))
    draw.multiline_text(
        (MARGIN, image.height - MARGIN), "\n".join(bottom), GREY, _font(SIZE - 2), anchor="ld"
    )
    return np.asarray(image)
