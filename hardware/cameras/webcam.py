"""A webcam by OpenCV."""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..vision.frame import Frame
from ..vision.opencv import opencv
from .base import CameraError, grey

V4L2_MANUAL_EXPOSURE = 1.0
WARM_UP_FRAMES = 5  # the first ones of many webcams are dark or half a picture
BUFFERS = 3
HOST_AGREEMENT = 5.0  # s; a driver's stamp further off is no time of this computer


@dataclass(frozen=True)
class WebcamSettings:
    """How to run a webcam.

    Attributes:
        size: Width and height [px].
        rate: Frames per second.
        exposure: In the driver's unit, for V4L2 0.1 ms; None leaves it to the camera, which then
            changes it with the light.
    """

    size: tuple[int, int] = (640, 480)
    rate: float = 30.0
    exposure: float | None = None


class Webcam:
    """One webcam, opened by its number or the path of its device."""

    def __init__(self, source: int | str, settings: WebcamSettings | None = None) -> None:
        """Open and set up the camera.

        Raises:
            CameraError: it cannot be opened, gives no picture, or gives another size.
        """
        settings = WebcamSettings() if settings is None else settings
        self._source = source
        self._index = 0
        self._stamped = False
        self._capture = opencv().VideoCapture(source)
        try:
            if not self._capture.isOpened():
                raise CameraError(
                    f"camera {source!r} cannot be opened: is it plugged in, may this user read "
                    "it, and does no other program hold it?"
                )
            _set_up(self._capture, settings)
            self._warm_up(settings.size)
        except CameraError:
            self.close()
            raise

    def read(self) -> Frame | None:
        """The next frame.

        Raises:
            CameraError: the camera stopped to deliver.
        """
        image = self._grab()
        host = time.monotonic()
        # the clocks of two frames must not differ: a stamp that stands is left out later on
        stamp = self._stamp() if self._stamped else host
        self._index += 1
        return Frame(self._index - 1, stamp, host, np.ascontiguousarray(grey(image)))

    def close(self) -> None:
        """Let the device go."""
        self._capture.release()

    def _grab(self) -> np.ndarray:
        seen, image = self._capture.read()
        if not seen or image is None:
            raise CameraError(
                f"camera {self._source!r} delivers no picture after frame {self._index}: check "
                "its cable, and that it does not share one USB hub with the other camera"
            )
        return image

    def _warm_up(self, size: tuple[int, int]) -> None:
        """Take frames until the camera gives good ones, and see whether its driver stamps them."""
        stamps, ages = [], []
        for _ in range(WARM_UP_FRAMES):
            height, width = self._grab().shape[:2]
            stamps.append(self._stamp())
            ages.append(abs(time.monotonic() - stamps[-1]))
            if (width, height) != size:
                raise CameraError(
                    f"camera {self._source!r} delivers {width}x{height} instead of "
                    f"{size[0]}x{size[1]}: set a size that it has, and calibrate it at that size"
                )

        self._stamped = bool((np.diff(stamps) > 0).all()) and max(ages) < HOST_AGREEMENT

    def _stamp(self) -> float:
        """V4L2's time of the latest frame [s]; something else with other drivers."""
        return 1e-3 * self._capture.get(opencv().CAP_PROP_POS_MSEC)


def _set_up(capture: Any, settings: WebcamSettings) -> None:
    cv2 = opencv()
    # two raw streams do not fit on one USB 2 bus; the format must be set before the size
    capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
    capture.set(cv2.CAP_PROP_FRAME_WIDTH, settings.size[0])
    capture.set(cv2.CAP_PROP_FRAME_HEIGHT, settings.size[1])
    capture.set(cv2.CAP_PROP_FPS, settings.rate)
    # with one buffer the driver has none to fill while a picture is measured
    capture.set(cv2.CAP_PROP_BUFFERSIZE, BUFFERS)
    if settings.exposure is not None:
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, V4L2_MANUAL_EXPOSURE)
        capture.set(cv2.CAP_PROP_EXPOSURE, settings.exposure)
