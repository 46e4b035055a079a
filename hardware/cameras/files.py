"""Frames from a video file or a directory of pictures, through the interface of a camera."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..vision.camera_model import opencv
from ..vision.frame import Frame
from .base import CameraError, FrameSource, grey

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")


class FilesCamera(FrameSource):
    """Reads what was recorded, as fast as it is asked for."""

    def __init__(self, path: str | Path, *, rate: float = 30.0) -> None:
        """Open a video file, or a directory of pictures, in the order of their names.

        Numbers in names count as numbers: 2.png comes before 10.png. Hidden files are passed over.

        Args:
            path: File or directory.
            rate: Of a directory's pictures [1/s]; a video file knows its own times.

        Raises:
            CameraError: there is nothing at `path`, or nothing that can be read.
            ValueError: `rate` is not positive.
        """
        if not rate > 0:
            raise ValueError(f"rate must be positive, got {rate}")
        path = Path(path)
        if path.is_dir():
            self._frames = _pictures(_names(path), rate)
        elif path.is_file():
            self._frames = _video(path)
        else:
            raise CameraError(f"there is no video file or directory of pictures at {path}")
        # the first frame is read now: what cannot be read is refused on opening
        self._first: Frame | None = next(self._frames, None)
        if self._first is None:
            raise CameraError(f"{path} holds no frame that OpenCV can read")

    def read(self) -> Frame | None:
        if self._first is not None:
            frame, self._first = self._first, None
            return frame
        return next(self._frames, None)

    def close(self) -> None:
        self._first = None
        self._frames = iter(())


def _names(directory: Path) -> list[Path]:
    pictures = (path for path in directory.iterdir() if path.suffix.lower() in PICTURES)
    # a hidden one, such as `._1.png`, is a note of the system about a picture
    names = sorted((path for path in pictures if not path.name.startswith(".")), key=_in_order)
    if not names:
        raise CameraError(f"{directory} holds no pictures ({', '.join(PICTURES)})")
    return names


def _in_order(path: Path) -> tuple[list[int | str], str]:
    """So that 2.png comes before 10.png; of two equal numbers, by the whole name."""
    parts = re.split(r"([0-9]+)", path.name.casefold())
    return [int(part) if at % 2 else part for at, part in enumerate(parts)], path.name


def _pictures(names: list[Path], rate: float) -> Iterator[Frame]:
    cv2 = opencv()
    for index, name in enumerate(names):
        image = cv2.imread(str(name), cv2.IMREAD_GRAYSCALE)
        if image is None:
            raise CameraError(f"{name} is no picture that OpenCV can read; remove it")
        yield Frame(index, index / rate, image)


def _video(path: Path) -> Iterator[Frame]:
    cv2 = opencv()
    capture = cv2.VideoCapture(str(path))
    try:
        index = 0
        while True:
            seen, image = capture.read()
            if not seen:
                return
            stamp = 1e-3 * capture.get(cv2.CAP_PROP_POS_MSEC)
            yield Frame(index, stamp, np.ascontiguousarray(grey(image)))
            index += 1
    finally:
        capture.release()
