"""Write movies with PyAV and Pillow, which are already dependencies.

imageio-ffmpeg would add 68 MB.
"""

from collections.abc import Iterable, Mapping
from fractions import Fraction
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import write_whole

Pictures = Iterable[NDArray[np.uint8]]
PICTURE_RATE = 25.0  # pictures/s; a GIF's clock counts hundredths of a second
ANIMATIONS: Mapping[str, Mapping[str, Any]] = {
    ".gif": {"format": "GIF", "optimize": False},
    ".webp": {"format": "WEBP", "quality": 85, "method": 2},
}
"""Options of Pillow by the ending of the name."""

KINDS = (".mp4", *ANIMATIONS)
H264_RATE_FACTOR = "20"  # constant rate factor of H.264: lower is better and larger


def check_movie(path: Path) -> None:
    """Refuse a file that cannot be written here, before anything is drawn.

    Raises:
        InputError: The ending is unknown.
        ImportError: The ending needs an extra that is not installed.
    """
    if path.suffix.lower() not in KINDS:
        raise InputError(
            f"unknown kind of movie {path.suffix!r}",
            where=str(path),
            fix=f"let the name end in {', '.join(KINDS)}",
        )
    if path.suffix.lower() == ".mp4":
        _av()


def write_movie(path: Path, pictures: Pictures, rate: float = PICTURE_RATE) -> Path:
    """Write a movie whole, or nothing.

    Args:
        path: Ends in .mp4, .gif or .webp; the latter two play again and again.
        pictures: Red, green and blue, of one shape [height, width, 3]; one at least.
        rate: Pictures per second.

    Raises:
        InputError, ImportError: As `check_movie`.
    """
    check_movie(path)
    if (kind := path.suffix.lower()) == ".mp4":
        return write_whole(path, lambda temporary: _write_mp4(temporary, pictures, rate))
    options = ANIMATIONS[kind]
    return write_whole(path, lambda file: _write_animation(file, pictures, rate, options))


def encoded(pictures: Pictures, rate: float) -> bytes:
    """A movie in WebP, of pictures and rate as `write_movie` takes them."""
    content = BytesIO()
    _write_animation(content, pictures, rate, ANIMATIONS[".webp"])
    return content.getvalue()


def _av():
    try:
        import av
    except ModuleNotFoundError as err:
        raise ImportError(
            "a movie in .mp4 needs: pip install 'bolfi-liquids[cameras]'; .gif and .webp do not"
        ) from err
    return av


def _write_mp4(path: Path, pictures: Pictures, rate: float) -> None:
    av = _av()
    iterator = iter(pictures)
    first = next(iterator)
    height, width = (side - side % 2 for side in first.shape[:2])  # as the colours' format needs
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as file:
        stream = file.add_stream("libx264", Fraction(rate).limit_denominator(1000))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": H264_RATE_FACTOR}
        for picture in chain([first], iterator):
            even = np.ascontiguousarray(picture[:height, :width])
            file.mux(stream.encode(av.VideoFrame.from_ndarray(even, "rgb24")))
        file.mux(stream.encode())


def _write_animation(
    file: Path | BytesIO, pictures: Pictures, rate: float, options: Mapping[str, Any]
) -> None:
    from PIL import Image

    first, *others = [Image.fromarray(picture) for picture in pictures]
    duration = round(1000.0 / rate)  # ms
    first.save(file, save_all=True, append_images=others, duration=duration, loop=0, **options)
