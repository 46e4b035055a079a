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
        RigError: There is no such driver, or it does not work.
    """
    if camera.driver is not None:
        return _driven(camera)
    if camera.is_device:
        return Webcam(camera.source, size=(camera.width, camera.height), rate=camera.rate)
    return FilesCamera(str(camera.source), rate=camera.rate)


def webcams(rig: Rig) -> dict[View, Callable[[], FrameSource]]:
    """By view, what opens the camera that the rig's file names, in the process that reads it."""
    return {camera.view: partial(open_camera, camera) for camera in rig.cameras}


def _driven(camera: Camera) -> FrameSource:
    """Camera of a driver that is a file of its own, such as "my_camera.py:MyCamera"."""
    path, _, name = str(camera.driver).rpartition(":")
    try:
        spec = spec_from_file_location(Path(path).stem, path)
        if spec is None or spec.loader is None:
            raise FileNotFoundError(f"{path} is no Python file")
        spec.loader.exec_module(module := module_from_spec(spec))
        return getattr(module, name)(camera)
    except CameraError:
        raise
    except Exception as err:  # of a file that a person wrote: whatever is wrong in it
        why = " ".join(str(err).split())
        raise RigError(
            f"{camera.driver}: {type(err).__name__}: {why}",
            where=f"cameras: {camera.view}: driver",
            fix="correct that file, or give the driver's file, beside rig.toml, and its class: "
            "my_camera.py:MyCamera",
        ) from err
