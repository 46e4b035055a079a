"""Calibration of one of a rig's cameras, from files or with the camera itself."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import Argument, InputError
from ..inputs.rigs import rig_of

if TYPE_CHECKING:
    from ..hardware import Camera
    from ..hardware.session.camera_calibration import CalibratedCamera

VIEWS = ("xz", "yz")
BOARD_PICTURES = 15


def write_board(path: Path) -> Path:
    """Write the picture of the board that is to be printed.

    Raises:
        InputError: There is a file already, or none can be written.
    """
    from ..hardware.vision import CharucoBoard
    from ..hardware.vision.opencv import opencv

    if path.exists():
        raise InputError("exists already", where=str(path), fix="name a file that does not")
    can_be = path.suffix.lower() == ".png" and path.parent.is_dir()
    if not (can_be and opencv().imwrite(str(path), CharucoBoard().print_image())):
        raise InputError("cannot be written", where=str(path), fix="name a .png that can be")
    return path


class Pictures(NamedTuple):
    """Pictures from which a camera is calibrated.

    Attributes:
        square: Side of a printed square [m].
        boards: Directory of pictures of the board; None takes them with the camera.
        plumb: Picture of a plumb line; None takes it with the camera, unless `boards` is given.
    """

    square: float
    boards: Path | None = None
    plumb: Path | None = None


def calibrate_view(
    rig: Path | None, view: str, pictures: Pictures, *, out: Path | None = None
) -> Iterator[str]:
    """Calibrate a camera and write its lens; yields what to tell.

    Args:
        rig: Its file; None is the bundled one.
        view: "xz" or "yz".
        pictures: Of the board and of a plumb line.
        out: File of the lens; None is beside the rig's file.

    Raises:
        InputError: `view` or `square` cannot be used.
        RigError: The rig, the camera or the pictures cannot be used.
    """
    from ..hardware.session.camera_calibration import (
        calibrate_camera,
        pictures_in,
        take_pictures,
        write_lens,
    )
    from ..hardware.vision import CharucoBoard

    if view not in VIEWS:
        raise InputError(f"{view!r}", where=Argument("view"), fix="give xz or yz")
    square, boards, plumb = pictures
    if not 0.002 <= square <= 0.2:
        raise InputError(
            f"{100 * square:g} cm",
            where=Argument("square"),
            fix="give the side of a printed square in cm",
        )
    camera = rig_of(rig).camera("xz" if view == "xz" else "yz")
    board = CharucoBoard(
        square=square, marker=square * CharucoBoard().marker / CharucoBoard().square
    )
    live = boards is None and plumb is None
    on_board = pictures_in(boards) if boards is not None else []
    hanging = pictures_in(plumb)[0] if plumb is not None else None
    if live:
        on_board = take_pictures(camera, BOARD_PICTURES, _ask_for_board)
        (hanging,) = take_pictures(camera, 1, _ask_for_plumb_line)
    calibrated = calibrate_camera(camera, on_board, board, hanging)
    if calibrated.intrinsics is not None:
        beside = Path(rig).parent if rig is not None else Path()
        path = write_lens(calibrated, beside / f"camera_{view}.json" if out is None else out)
        yield from _about_lens(calibrated, path)
    yield from _about_roll(camera, calibrated)


def _about_lens(calibrated: "CalibratedCamera", path: Path) -> Iterator[str]:
    lens = calibrated.intrinsics
    assert lens is not None
    yield (
        f"lens: focal length {lens.focal[0]:.1f} x {lens.focal[1]:.1f} px "
        f"(+- {max(lens.focal_error):.1f}), corners {lens.rms:.2f} px off, {lens.views} pictures"
    )
    if lens.legacy:
        yield "board: its pattern is the older one (OpenCV before 4.6), and was read as such"
    yield f'wrote {path}: set intrinsics = "{path.name}" for this camera in rig.toml'


def _about_roll(camera: "Camera", calibrated: "CalibratedCamera") -> Iterator[str]:
    if not np.isfinite(calibrated.roll_error):
        yield f"roll: kept at {camera.roll_deg:g} deg (no plumb line was given)"
        return
    yield (
        f"roll: {np.degrees(calibrated.roll):.2f} +- {np.degrees(calibrated.roll_error):.2f} deg: "
        f"set roll_deg = {np.degrees(calibrated.roll):.2f} for this camera in rig.toml"
    )


def _ask_for_board(number: int) -> None:
    input(f"board, picture {number} of {BOARD_PICTURES}: hold it still, tilted, then press Enter ")


def _ask_for_plumb_line(_: int) -> None:
    input("plumb line: hang a thread in front of an even background, then press Enter ")
