"""OpenCV, imported on use."""

from functools import cache
from types import ModuleType


@cache
def opencv() -> ModuleType:
    """The module `cv2`, told to use one thread, as every camera has a process of its own.

    Raises:
        ImportError: OpenCV is not installed; the message names the extra that brings it.
    """
    try:
        import cv2
    except ModuleNotFoundError as err:
        raise ImportError(
            "cameras need OpenCV, which is not installed: pip install 'bolfi-liquids[cameras]'"
        ) from err
    cv2.setNumThreads(1)
    # what it warns of, our own errors say with the camera's name
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    return cv2
