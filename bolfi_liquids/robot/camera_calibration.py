"""Calibration of one of a rig's cameras: its lens by a printed board, its roll by a plumb line."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import Argument
from ..files import new_file, write_whole
from ..inputs.rigs import rig_of

if TYPE_CHECKING:
    from ..hardware import Camera
    from ..hardware.rig import View
    from ..hardware.vision import CameraModel, Intrinsics

BOARD_PICTURES = 15


def write_board(path: Path) -> Path:
    """Write the picture of the board that is to be printed.

    Raises:
        InputError: There is a file already, or none can be written.
    """
    from ..hardware.vision import CharucoBoard
    from ..hardware.vision.camera_model import opencv

    path = new_file(path, Argument("print_board"), suffix=".png", replace=False)
    _, picture = opencv().imencode(".png", CharucoBoard().print_image())
    return write_whole(path, lambda temporary: temporary.write_bytes(picture.tobytes()))


@contextmanager
def _refused(kind: type[Exception], where: str, fix: str) -> Iterator[None]:
    """Turn such an error of hardware into a `RigError` that names what to mend."""
    from ..hardware import RigError

    try:
        yield
    except kind as err:
        raise RigError(str(err), where=where, fix=fix) from err


def calibrate_view(
    rig: Path | None,
    view: "View",
    *,
    square: float,
    boards: Path | None = None,
    plumb_line: Path | None = None,
    out: Path | None = None,
) -> Iterator[str]:
    """Calibrate a camera and write its lens; yields what to tell.

    Args:
        rig: Its file; None is the bundled one.
        view: Which camera.
        square: Side of a printed square [m].
        boards: Directory of pictures of the board.
        plumb_line: Picture of a plumb line. With neither, the camera takes both.
        out: File of the lens; None is beside the rig's file.

    Raises:
        RigError: The rig, the camera or the pictures cannot be used.
    """
    from ..hardware.vision import CalibrationError, CharucoBoard, calibrate_intrinsics
    from ..hardware.vision.stick_view import camera_model, orientation

    camera = rig_of(rig).camera(view)
    usual = CharucoBoard()
    board = CharucoBoard(square=square, marker=square * usual.marker / usual.square)
    if boards is None and plumb_line is None:
        on_board, thread = _taken(camera)
    else:
        on_board = [] if boards is None else _read(boards)
        thread = None if plumb_line is None else _read(plumb_line)[0]
    with _refused(CalibrationError, where=f"camera {view}", fix="take the pictures again"):
        if on_board:
            lens = calibrate_intrinsics(on_board, board)
            beside = Path() if rig is None else Path(rig).parent
            yield from _written(lens, beside / f"camera_{view}.json" if out is None else out)
            model = lens.placed(orientation(camera), np.array(camera.position))
        else:
            model = camera_model(camera)
        yield _roll(camera, model, thread)


def _read(path: Path) -> list[np.ndarray]:
    """All pictures of a directory, of a video, or the one of a file; grey levels."""
    from ..hardware.cameras import CameraError, FilesCamera

    with _refused(CameraError, where=str(path), fix="give a directory of pictures"):
        return [frame.image for frame in iter(FilesCamera(path).read, None)]


def _taken(camera: "Camera") -> tuple[list[np.ndarray], np.ndarray]:
    """Pictures of the board and of the plumb line, grey levels, each once a person is ready."""
    from ..hardware.cameras import CameraError, open_camera

    how = "hold it still, tilted, then press Enter "
    hang = "plumb line: hang a thread in front of an even background, then press Enter "
    numbers = range(1, BOARD_PICTURES + 1)
    asked = [f"board, picture {n} of {BOARD_PICTURES}: {how}" for n in numbers]
    where = f"camera {camera.view}: source = {camera.source!r}"
    with (
        _refused(CameraError, where=where, fix="correct rig.toml"),
        closing(open_camera(camera)) as source,
    ):

        def after(question: str) -> np.ndarray:
            input(question)
            source.read()  # what the driver has kept from before
            if (frame := source.read()) is None:
                raise CameraError("the camera gives no more pictures")
            return frame.image

        return [after(question) for question in asked], after(hang)


def _written(lens: "Intrinsics", path: Path) -> Iterator[str]:
    """Write the lens; place and roll stay in rig.toml itself."""
    from ..hardware.vision import write_camera

    write_camera(lens.placed(np.eye(3), np.zeros(3)), path)
    yield (
        f"lens: focal length {lens.focal[0]:.1f} x {lens.focal[1]:.1f} px "
        f"(+- {max(lens.focal_error):.1f}), corners {lens.rms:.2f} px off, {lens.views} pictures"
    )
    if lens.legacy:
        yield "board: its pattern is the older one (OpenCV before 4.6), and was read as such"
    yield f'wrote {path}: set intrinsics = "{path.name}" for this camera in rig.toml'


def _roll(camera: "Camera", model: "CameraModel", plumb_line: np.ndarray | None) -> str:
    from ..hardware.vision import level_camera

    if plumb_line is None:
        return f"roll: kept at {camera.roll_deg:g} deg (no plumb line was given)"
    levelled = level_camera(plumb_line, model)
    roll = camera.roll_deg + np.degrees(levelled.roll)
    return (
        f"roll: {roll:.2f} +- {np.degrees(levelled.error):.2f} deg: "
        f"set roll_deg = {roll:.2f} for this camera in rig.toml"
    )
