"""A rig's own cameras, opened in the processes that read them."""

from collections.abc import Callable
from typing import NamedTuple

from ..cameras.base import FrameSource
from ..rig import Camera, Rig, View


class RigCamera(NamedTuple):
    """Opens one camera of a rig; can be sent to another process."""

    camera: Camera

    def __call__(self) -> FrameSource:
        from ..cameras import FilesCamera, Webcam, WebcamSettings

        camera = self.camera
        if camera.is_device:
            settings = WebcamSettings(size=(camera.width, camera.height), rate=camera.rate)
            return Webcam(camera.source, settings)
        return FilesCamera(str(camera.source), rate=camera.rate)


def webcams(rig: Rig) -> dict[View, Callable[[], FrameSource]]:
    """By view, what opens the camera that the rig's file names."""
    return {camera.view: RigCamera(camera) for camera in rig.cameras}
