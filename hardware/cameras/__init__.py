"""Cameras: webcams, files, and rendered ones."""

from ..vision.frame import Frame
from .base import CameraError, FrameSource
from .files import FilesCamera
from .rendered import RenderedCamera, Timing
from .webcam import Webcam

__all__ = [
    "CameraError",
    "FilesCamera",
    "Frame",
    "FrameSource",
    "RenderedCamera",
    "Timing",
    "Webcam",
]
