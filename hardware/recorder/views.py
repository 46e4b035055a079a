"""What a rig's cameras see: its sizes and lenses in the form that the measurement takes."""

from pathlib import Path

import numpy as np

from ..errors import RigError
from ..rig import Camera, Rig, View
from ..vision.camera_model import CameraModel, CameraModelError, look_at, read_camera
from ..vision.stick_view import Scene, StickView


def camera_model(camera: Camera) -> CameraModel:
    """Lens and place of a rig's camera.

    The rig tells where it stands; the lens is that of its `intrinsics` file, or a perfect one.

    Raises:
        RigError: The file of its lens cannot be used, or it looks straight up or down.
    """
    rotation = orientation(camera)
    size, place = (camera.width, camera.height), np.array(camera.position)
    if camera.intrinsics is None:
        focal = float(camera.focal_length or np.nan)
        middle = ((camera.width - 1) / 2, (camera.height - 1) / 2)
        return CameraModel((focal, focal), middle, size, rotation, place)
    lens = _lens(camera)
    return CameraModel(lens.focal, lens.centre, size, rotation, place, lens.distortion)


def orientation(camera: Camera) -> np.ndarray:
    """Turns vectors of the cup frame into the camera's, shape (3, 3); see `look_at`.

    Raises:
        RigError: It looks straight up or down.
    """
    position, target = np.array(camera.position), np.array(camera.target)
    try:
        return look_at(position, target, np.radians(camera.roll_deg))
    except CameraModelError as err:
        raise RigError(str(err), where=f"cameras: {camera.view}", fix="correct rig.toml") from err


def _lens(camera: Camera) -> CameraModel:
    where = f"cameras: {camera.view}: intrinsics"
    try:
        lens = read_camera(Path(str(camera.intrinsics)))
    except OSError as err:
        raise RigError(
            f"{camera.intrinsics}: {err.strerror}",
            where=where,
            fix="run: bolfi-liquids rig calibrate-cameras",
        ) from err
    except CameraModelError as err:
        raise RigError(str(err), where=where, fix="write the file again") from err
    if lens.size != (camera.width, camera.height):
        raise RigError(
            f"calibrated at {lens.size[0]}x{lens.size[1]}, recorded at "
            f"{camera.width}x{camera.height}",
            where=where,
            fix="calibrate at the size that is recorded",
        )
    return lens


def stick_view(rig: Rig, view: View, camera: CameraModel | None = None) -> StickView:
    """What is known about one view before its first picture.

    Args:
        rig: Its sizes.
        view: Which camera.
        camera: Its lens and place; those of the rig where it is not given.

    Raises:
        RigError: See `camera_model`.
    """
    return StickView(
        scene(rig, view),
        camera or camera_model(rig.camera(view)),
        # the wall of the cup bends what is seen through it
        surface_height=rig.cup.height,
        contrast=rig.stick.colour,
    )


def scene(rig: Rig, view: View) -> Scene:
    """Sizes of the cup, the stick and the marker that a rig's camera looks at."""
    camera = rig.camera(view)
    return Scene(
        marker_offset=camera.marker,
        cup_radius=rig.cup.radius,
        cup_height=rig.cup.height,
        fill=rig.cup.fill,
        stick_radius=rig.stick.radius,
        stick_length=rig.stick.length,
        marker_radius=camera.marker_radius,
    )
