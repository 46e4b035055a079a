"""A rig's own cameras, opened in the processes that read them."""

from collections.abc import Callable
from functools import partial

from ..cameras.base import FrameSource
from ..rig import Camera, Rig, View


def open_camera(camera: Camera) -> FrameSource:
    """Open the device or the files that a rig's file names.

    Raises:
        CameraError: It cannot be opened.
    """
    from ..cameras import FilesCamera, Webcam

    if camera.is_device:
        return Webcam(camera.source, size=(camera.width, camera.height), rate=camera.rate)
    return FilesCamera(str(camera.source), rate=camera.rate)


def webcams(rig: Rig) -> dict[View, Callable[[], FrameSource]]:
    """By view, what opens the camera that the rig's file names."""
    return {camera.view: partial(open_camera, camera) for camera in rig.cameras}
