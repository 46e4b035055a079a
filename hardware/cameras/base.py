"""Protocol of cameras: frames with the time at which a camera gave them."""

from abc import abstractmethod
from typing import Protocol

import numpy as np

from ..vision.camera_model import opencv
from ..vision.frame import Frame


class CameraError(RuntimeError):
    """A camera cannot be used; the message names it and says what to do."""


class FrameSource(Protocol):
    """Anything that delivers frames."""

    @abstractmethod
    def read(self) -> Frame | None:
        """The next frame; waits for it. None when there will be no more.

        Raises:
            CameraError: the camera fails.
        """

    @abstractmethod
    def close(self) -> None:
        """Let the device or file go; harmless when repeated."""


def grey(image: np.ndarray) -> np.ndarray:
    """The picture's grey levels, shape (height, width), from grey or OpenCV's BGR."""
    if image.ndim == 2:
        return image
    cv2 = opencv()
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
