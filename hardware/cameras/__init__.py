"""Cameras: webcams, files, and rendered ones."""

from ..vision.frame import Frame
from .base import Camera, CameraError
from .files import FilesCamera
from .rendered import RenderedCamera, Timing
from .webcam import Webcam, WebcamSettings

__all__ = [
    "Camera",
    "CameraError",
    "FilesCamera",
    "Frame",
    "RenderedCamera",
    "Timing",
    "Webcam",
    "WebcamSettings",
]
