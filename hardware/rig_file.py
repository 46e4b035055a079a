"""Reading a rig.toml, and the one that comes with the package."""

import tomllib
from importlib.resources import as_file, files
from pathlib import Path

from pydantic import ValidationError

from .errors import RigError
from .rig import Rig
from .rig_geometry import check_geometry

BUNDLED = "rig.toml"


def open_rig(path: str | Path) -> Rig:
    """Read a rig that a person wrote down.

    Paths in it (`intrinsics`, `source`) count from the file's own directory.

    Raises:
        RigError: The file is missing or cannot be used; the message names the field.
    """
    path = Path(path)
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as err:
        what = getattr(err, "strerror", None) or "not a text file"
        raise RigError(what, where=str(path), fix="give the path of a rig.toml") from err
    except tomllib.TOMLDecodeError as err:
        raise RigError(f"not TOML: {err}", where=str(path), fix="correct that line") from err
    try:
        rig = Rig.model_validate(written)
    except ValidationError as err:
        raise _explained(err, str(path)) from err
    return _beside(check_geometry(rig, str(path)), path.parent)


def bundled_rig() -> Rig:
    """The rig that comes with the package; no robot answers at its address."""
    with as_file(files(f"{__package__}.data") / BUNDLED) as path:
        return open_rig(path)


def checked_rig(rig: Rig, where: str = "rig") -> Rig:
    """The rig itself: copies of a rig may hold numbers that its file may not.

    Raises:
        RigError: A number is not allowed, or they contradict each other.
    """
    try:
        Rig.model_validate(rig.model_dump())
    except ValidationError as err:
        raise _explained(err, where) from err
    return check_geometry(rig, where)


def _explained(err: ValidationError, file: str) -> RigError:
    found = err.errors(include_url=False, include_context=False)
    # a mistyped name is also a missing one
    first = next((one for one in found if one["type"] == "extra_forbidden"), found[0])
    field = ".".join(map(str, first["loc"]))
    message = first["msg"].removeprefix("Value error, ")
    given = first["input"]
    what = message if isinstance(given, dict) else f"{message}, got {given!r:.60}"
    return RigError(
        what,
        where=f"{file}: {field}" if field else file,
        fix="compare with the bundled rig.toml (SI units unless the name says otherwise)",
    )


def _beside(rig: Rig, directory: Path) -> Rig:
    def placed(name: str | int | None) -> str | int | None:
        return str(directory / name) if isinstance(name, str) else name

    cameras = tuple(
        camera.model_copy(
            update={"intrinsics": placed(camera.intrinsics), "source": placed(camera.source)}
        )
        for camera in rig.cameras
    )
    return rig.model_copy(update={"cameras": cameras})
