"""A rig's camera calibrated: its lens by a printed board, its roll by a plumb line."""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..cameras import CameraError, FilesCamera, FrameSource
from ..errors import RigError
from ..recorder.views import camera_model
from ..rig import Camera
from ..vision.camera_model import CameraModel, write_camera
from ..vision.charuco import CalibrationError, CharucoBoard, Intrinsics, calibrate_intrinsics
from ..vision.plumb_line import PlumbLineError, level_camera
from .cameras import RigCamera


class CalibratedCamera(NamedTuple):
    """What pictures tell of a camera.

    Attributes:
        intrinsics: Of its lens; None where there was no picture of a board.
        model: With that lens, at the rig's place, rolled as the plumb line says.
        roll: Of the camera about its axis, as rig.toml takes it [rad].
        roll_error: Its standard error [rad]; NaN without a picture of a plumb line.
    """

    intrinsics: Intrinsics | None
    model: CameraModel
    roll: float
    roll_error: float


def calibrate_camera(
    camera: Camera, boards: Sequence[np.ndarray], board: CharucoBoard, plumb_line: np.ndarray | None
) -> CalibratedCamera:
    """Lens and roll of a rig's camera.

    Args:
        camera: As the rig's file has it.
        boards: Pictures of the board, grey levels; empty to keep the lens.
        board: That was printed.
        plumb_line: Picture of a plumb line; None to keep the roll.

    Raises:
        RigError: The pictures do not determine what they should.
    """
    where = f"camera {camera.view}"
    try:
        intrinsics = calibrate_intrinsics(boards, board) if boards else None
        model = camera_model(camera if intrinsics is None else _without_lens(camera))
        if intrinsics is not None:
            model = intrinsics.placed(model.rotation, model.position)
        roll = float(np.radians(camera.roll_deg))
        if plumb_line is None:
            return CalibratedCamera(intrinsics, model, roll, float("nan"))
        levelled = level_camera(plumb_line, model)
    except (CalibrationError, PlumbLineError) as err:
        raise RigError(str(err), where=where, fix="take the pictures again") from err
    return CalibratedCamera(intrinsics, levelled.camera, roll + levelled.roll, levelled.error)


def write_lens(calibrated: CalibratedCamera, path: Path) -> Path:
    """Write the lens for `intrinsics` of rig.toml; place and roll stay in rig.toml itself."""
    upright = replace(calibrated.model, rotation=np.eye(3), position=np.zeros(3))
    write_camera(upright, path)
    return path


def pictures_in(path: Path) -> list[np.ndarray]:
    """All pictures of a directory, or of a video.

    Raises:
        RigError: There are none that can be read.
    """
    try:
        source = FilesCamera(path)
        frames = iter(source.read, None)
        return [frame.image for frame in frames]
    except CameraError as err:
        raise RigError(str(err), where=str(path), fix="give a directory of pictures") from err


def take_pictures(camera: Camera, count: int, ask: Callable[[int], object]) -> list[np.ndarray]:
    """Pictures of the camera, one each time that `ask` returns.

    Args:
        camera: Of the rig.
        count: How many.
        ask: Waits for the person who holds the board; given the picture's number from 1.

    Raises:
        RigError: The camera cannot be used.
    """
    try:
        with closing(RigCamera(camera)()) as source:
            return [_after(ask, number, source) for number in range(1, count + 1)]
    except CameraError as err:
        where = f"camera {camera.view}: source = {camera.source!r}"
        raise RigError(str(err), where=where, fix="correct rig.toml") from err


def _after(ask: Callable[[int], object], number: int, source: FrameSource) -> np.ndarray:
    ask(number)
    source.read()  # what the driver has kept from before
    frame = source.read()
    if frame is None:
        raise CameraError("the camera gives no more pictures")
    return frame.image


def _without_lens(camera: Camera) -> Camera:
    # the lens that is there may be of another size; it is about to be replaced
    return camera.model_copy(update={"intrinsics": None, "focal_length": camera.width})
