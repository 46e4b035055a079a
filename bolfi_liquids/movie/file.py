"""Write movies with PyAV and Pillow, which are already dependencies.

imageio-ffmpeg would add 68 MB.
"""

from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from io import BytesIO
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import write_whole

Pictures = Iterable[NDArray[np.uint8]]
PICTURE_RATE = 25.0  # pictures/s; a GIF's clock counts hundredths of a second
H264_RATE_FACTOR = "20"  # constant rate factor of H.264: lower is better and larger


def check_movie(path: Path) -> None:
    """Refuse a file that cannot be written here, before anything is drawn.

    Raises:
        InputError: The ending is unknown.
        ImportError: The ending needs an extra that is not installed.
    """
    if path.suffix.lower() not in WRITERS:
        raise InputError(
            f"unknown kind of movie {path.suffix!r}",
            where=str(path),
            fix=f"let the name end in {', '.join(WRITERS)}",
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
    write = WRITERS[path.suffix.lower()]
    return write_whole(path, lambda temporary: write(temporary, pictures, rate))


def encoded(pictures: Pictures, rate: float) -> bytes:
    """A movie in WebP, of pictures and rate as `write_movie` takes them."""
    content = BytesIO()
    _write_webp(content, pictures, rate)
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
    iterator, first = _first(pictures)
    height, width = (side - side % 2 for side in first.shape[:2])  # as the colours' format needs
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as file:
        stream = file.add_stream("libx264", Fraction(rate).limit_denominator(1000))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": H264_RATE_FACTOR}
        for picture in iterator:
            even = np.ascontiguousarray(picture[:height, :width])
            file.mux(stream.encode(av.VideoFrame.from_ndarray(even, "rgb24")))
        file.mux(stream.encode())


def _write_gif(path: Path | BytesIO, pictures: Pictures, rate: float) -> None:
    _write_animation(path, pictures, rate, format="GIF", optimize=False)


def _write_webp(path: Path | BytesIO, pictures: Pictures, rate: float) -> None:
    _write_animation(path, pictures, rate, format="WEBP", quality=85, method=2)


def _write_animation(path: Path | BytesIO, pictures: Pictures, rate: float, **options) -> None:
    from PIL import Image

    images = [Image.fromarray(picture) for picture in pictures]
    duration = round(1000.0 / rate)  # ms
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=duration, loop=0, **options
    )


def _first(pictures: Pictures) -> tuple[Iterator[NDArray[np.uint8]], NDArray[np.uint8]]:
    """All pictures, and the first of them."""
    iterator = iter(pictures)
    first = next(iterator)
    return chain([first], iterator), first


WRITERS: dict[str, Callable[[Path, Pictures, float], None]] = {
    ".mp4": _write_mp4,
    ".gif": _write_gif,
    ".webp": _write_webp,
}
"""How a movie is written, by the ending of its name."""
