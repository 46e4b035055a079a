"""The directory of a recording: made before the arm moves, and complete without the rig's file."""

import hashlib
import json
import shutil
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..board import host_time
from ..errors import RigError
from ..rig import Rig, View
from ..vision.camera_model import CameraModel, as_fields, from_fields
from ..vision.stick_view import camera_model
from .events import EVENTS, FULL, drop_reserve, make_reserve, read_events
from .samples import SAMPLES

RIG = "rig.json"
VIEWS: tuple[View, View] = ("xz", "yz")
BYTES_PER_PIXEL = 0.3  # of a noisy picture as MJPEG
SAMPLE_BYTES = 320  # of a row of samples.csv
WAY_TIME = 30.0  # [s] from and to where the arm waits, at the most
SPARE_SPACE = 2.0  # times the need


def frames_file(view: View) -> str:
    """Name of the table of a view's frames."""
    return f"frames_{view}.csv"


def video_file(view: View) -> str:
    """Name of a view's video."""
    return f"{view}.mkv"


def truth_file(view: View) -> str:
    """Name of the table of what a view's rendered frames truly showed."""
    return f"truth_{view}.csv"


class Provenance(NamedTuple):
    """Content of a directory's rig.json.

    Attributes:
        rig: The rig that was recorded.
        hash: SHA-256 of the rig's fields.
        cameras: Lens and place by view.
        version: Of the package that recorded.
        started: Date and time (UTC, ISO 8601).
        extra: What the caller added; `source` describes where the data come from.
    """

    rig: Rig
    hash: str
    cameras: dict[View, CameraModel]
    version: str
    started: str
    extra: dict[str, Any]


def start_directory(
    directory: str | Path,
    rig: Rig,
    extra: dict[str, Any] | None = None,
    *,
    duration: float = 60.0,
    videos: bool = True,
) -> Path:
    """Make the directory of a recording and write its rig.json.

    Args:
        directory: Must not exist yet, or be empty.
        rig: What is recorded.
        extra: More to keep, as JSON can hold it; `source` becomes the recording's.
        duration: Of what will be recorded [s]; the disk must have room for it.
        videos: Whether the cameras' are part of it.

    Returns:
        `directory`.

    Raises:
        RigError: There are files in it, it cannot be made, the disk has too little room, or a
            camera's lens cannot be used.
    """
    directory = Path(directory)
    cameras = {view: as_fields(camera_model(rig.camera(view))) for view in VIEWS}
    written = {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "host": host_time(),
        "version": version("bolfi-liquids"),
        "hash": rig_hash(rig),
        "rig": rig.model_dump(mode="json"),
        "cameras": cameras,
        "extra": extra or {},
    }
    try:
        directory.mkdir(parents=True, exist_ok=True)
        check_empty(directory)
        _check_room(directory, expected_bytes(rig, duration, videos=videos))
        _begin(directory, json.dumps(written, indent=1) + "\n")
    except OSError as err:
        full = err.errno in FULL
        raise RigError(
            err.strerror or str(err),
            where=str(directory),
            fix="make room, or give a directory on another disk"
            if full
            else "give a directory that can be made and written to",
        ) from err
    return directory


def discard_directory(directory: Path) -> None:
    """Remove what a session has left that has ended before any motion.

    Nothing is done where the arm has moved, or where something cannot be removed; what is not of a
    session stays, and its directory with it.

    Args:
        directory: Which the session itself has made or found empty.
    """
    if any(event["kind"] == "began" for event in read_events(directory)):
        return
    with suppress(OSError):
        drop_reserve(directory)
        names = [RIG, EVENTS, SAMPLES]
        for view in VIEWS:
            names += [frames_file(view), video_file(view), truth_file(view)]
        for name in names:
            (directory / name).unlink(missing_ok=True)
        directory.rmdir()


def rig_hash(rig: Rig) -> str:
    """SHA-256 of a rig's fields, in hexadecimal."""
    return hashlib.sha256(json.dumps(rig.model_dump(mode="json")).encode()).hexdigest()


def expected_bytes(rig: Rig, duration: float, *, videos: bool = True) -> float:
    """Bytes that a recording of `duration` [s] may need on the disk."""
    cameras = rig.cameras if videos else ()
    pixels = sum(camera.width * camera.height * camera.rate for camera in cameras)
    per_second = BYTES_PER_PIXEL * pixels + SAMPLE_BYTES * rig.robot.rate
    return SPARE_SPACE * (duration + WAY_TIME) * per_second


def read_provenance(directory: Path) -> Provenance:
    """Read what `start_directory` wrote.

    Raises:
        RigError: There is no rig.json, or it is damaged.
    """
    path = directory / RIG
    try:
        written = json.loads(path.read_text(encoding="utf-8"))
        return Provenance(
            # without their check: it stays readable whatever ends an arm's numbers have since
            rig=Rig.model_validate(written["rig"]),
            hash=written["hash"],
            cameras={view: from_fields(written["cameras"][view]) for view in VIEWS},
            version=written["version"],
            started=written["started"],
            extra=written["extra"],
        )
    except (OSError, ValueError, ValidationError, KeyError, TypeError) as err:
        raise RigError(
            f"cannot be used ({type(err).__name__}: {err})",
            where=str(path),
            fix="give the directory of a recording, or restore it: none can be made without it",
        ) from err


def check_empty(directory: Path) -> None:
    """Refuse a directory that holds something.

    Raises:
        RigError: The message names a file in it.
        OSError: It cannot be looked into.
    """
    held = sorted(path.name for path in directory.iterdir())
    if held:
        raise RigError(
            f"holds {held[0]} already ({len(held)} files)",
            where=str(directory),
            fix="give a new directory; nothing is ever overwritten",
        )


def _begin(directory: Path, text: str) -> None:
    """Write rig.json and set the reserve aside, both or neither.

    Of two sessions that start together one goes on.
    """
    try:
        file = (directory / RIG).open("x", encoding="utf-8")
    except FileExistsError:
        check_empty(directory)
        raise
    try:
        with file:
            file.write(text)
        make_reserve(directory)
    except OSError:  # leave nothing in the way of the next try
        drop_reserve(directory)
        (directory / RIG).unlink()
        raise


def _check_room(directory: Path, need: float) -> None:
    free = shutil.disk_usage(directory).free
    if free < need:
        raise RigError(
            f"{free / 1e6:.0f} MB are free, the recording may need {need / 1e6:.0f} MB",
            where=str(directory),
            fix="make room, or give a directory on another disk",
        )
