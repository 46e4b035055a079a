"""A webcam by OpenCV."""

import time
from typing import Any

import numpy as np

from ..vision.camera_model import opencv
from ..vision.frame import Frame
from .base import CameraError, FrameSource, grey

WARM_UP_FRAMES = 5  # the first ones of many webcams are dark or half a picture
BUFFERS = 3
MAX_KEPT = 2 * BUFFERS  # pictures; all that a driver has kept, with some to spare
MIN_WAIT = 1e-3  # s; a picture that comes sooner was waiting for an unknown time


class Webcam(FrameSource):
    """One webcam, opened by its number or the path of its device."""

    def __init__(self, source: int | str, *, size: tuple[int, int], rate: float = 30.0) -> None:
        """Open and set up the camera.

        Args:
            source: Number of the device, or its path.
            size: Width and height of the pictures [px].
            rate: Pictures per second.

        Raises:
            CameraError: it cannot be opened, gives no picture, or gives another size.
        """
        self._source = source
        self._index = 0
        self._capture = opencv().VideoCapture(source)
        try:
            if not self._capture.isOpened():
                raise CameraError(
                    f"camera {source!r} cannot be opened: is it plugged in, may this user read "
                    "it, and does no other program hold it?"
                )
            _set_up(self._capture, size, rate)
            self._warm_up(size)
        except CameraError:
            self.close()
            raise

    def read(self) -> Frame | None:
        """Wait for the next frame; frames that the driver kept are skipped, their time is unknown.

        Raises:
            CameraError: the camera stopped to deliver.
        """
        asked, stamp, grabbed = time.monotonic(), self._grab(), 1
        while stamp - asked < MIN_WAIT and grabbed < MAX_KEPT:
            asked, stamp, grabbed = stamp, self._grab(), grabbed + 1
        image = self._retrieve()
        return Frame(self._index - 1, stamp, np.ascontiguousarray(grey(image)))

    def close(self) -> None:
        self._capture.release()

    def _grab(self) -> float:
        """Wait for the driver's next picture; when it came [s]."""
        if not self._capture.grab():
            raise self._silent()
        stamp = time.monotonic()
        self._index += 1
        return stamp

    def _retrieve(self) -> np.ndarray:
        seen, image = self._capture.retrieve()
        if not seen or image is None:
            raise self._silent()
        return image

    def _silent(self) -> CameraError:
        return CameraError(
            f"camera {self._source!r} delivers no picture after frame {self._index}: check "
            "its cable, and that it does not share one USB hub with the other camera"
        )

    def _warm_up(self, size: tuple[int, int]) -> None:
        """Take frames until the camera gives good ones."""
        for _ in range(WARM_UP_FRAMES):
            self._grab()
            height, width = self._retrieve().shape[:2]
            if (width, height) != size:
                raise CameraError(
                    f"camera {self._source!r} delivers {width}x{height} instead of "
                    f"{size[0]}x{size[1]}: set a size that it has, and calibrate it at that size"
                )
        self._index = 0


def _set_up(capture: Any, size: tuple[int, int], rate: float) -> None:
    cv2 = opencv()
    # two raw streams do not fit on one USB 2 bus; the format must be set before the size
    capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
    capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
    capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
    capture.set(cv2.CAP_PROP_FPS, rate)
    # with one buffer the driver has none to fill while a picture is measured
    capture.set(cv2.CAP_PROP_BUFFERSIZE, BUFFERS)
