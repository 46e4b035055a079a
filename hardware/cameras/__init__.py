"""Cameras: webcams, files, rendered ones, and drivers of one's own."""

from collections.abc import Callable
from functools import partial
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from ..errors import RigError
from ..rig import Camera, Rig, View
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
    "open_camera",
    "webcams",
]


def open_camera(camera: Camera) -> FrameSource:
    """Open the driver, the device or the files that a rig's file names.

    Raises:
        CameraError: It cannot be opened.
        RigError: There is no such driver.
    """
    if camera.driver is not None:
        return _driver(camera)(camera)
    if camera.is_device:
        return Webcam(camera.source, size=(camera.width, camera.height), rate=camera.rate)
    return FilesCamera(str(camera.source), rate=camera.rate)


def webcams(rig: Rig) -> dict[View, Callable[[], FrameSource]]:
    """By view, what opens the camera that the rig's file names, in the process that reads it."""
    return {camera.view: partial(open_camera, camera) for camera in rig.cameras}


def _driver(camera: Camera) -> Callable[[Camera], FrameSource]:
    """Class of a driver that is a file of its own, such as "my_camera.py:MyCamera"."""
    path, _, name = str(camera.driver).rpartition(":")
    spec = spec_from_file_location(Path(path).stem, path)
    try:
        if spec is None or spec.loader is None:
            raise FileNotFoundError(f"{path} is no Python file")
        spec.loader.exec_module(module := module_from_spec(spec))
        return getattr(module, name)
    except (OSError, AttributeError) as err:
        raise RigError(
            f"{camera.driver}: {err}",
            where=f"cameras: {camera.view}: driver",
            fix="give the driver's file, beside rig.toml, and its class: my_camera.py:MyCamera",
        ) from err
