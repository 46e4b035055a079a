"""Reading a rig.toml, and the one that comes with the package."""

import tomllib
from collections.abc import Iterator
from difflib import get_close_matches
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from .errors import RigError
from .rig import Rig
from .rig_checks import contradictions
from .rig_numbers import COMPARE, Fault, RigSection, beyond_their_ends

BUNDLED = "rig.toml"


def open_rig(path: str | Path) -> Rig:
    """Read a rig that a person wrote down.

    Paths in it (`intrinsics`, `source`) count from the file's own directory.

    Raises:
        RigError: The file is missing or cannot be used; the message names the fields.
    """
    path = Path(path)
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as err:
        what = getattr(err, "strerror", None) or "not a text file"
        raise RigError(what, where=str(path), fix="give the path of a rig.toml") from err
    except tomllib.TOMLDecodeError as err:
        raise RigError(f"not TOML: {err}", where=str(path), fix="correct that line") from err
    return _beside(_checked(written, str(path)), path.parent)


def bundled_rig() -> Rig:
    """The rig that comes with the package; no robot answers at its address."""
    with as_file(files(f"{__package__}.data") / BUNDLED) as path:
        return open_rig(path)


def checked_rig(rig: Rig, where: str = "rig") -> Rig:
    """The rig itself: copies of a rig may hold numbers that its file may not.

    Raises:
        RigError: A number is not allowed, or they contradict each other.
    """
    _checked(rig.model_dump(), where)
    return rig


def _checked(written: dict[str, Any], where: str) -> Rig:
    """The rig of a file's content, all of whose fields are known, there, and as they should be."""
    faults = list(_unknown(Rig, written))
    try:
        rig = Rig.model_validate(written)
    except ValidationError as err:
        raise _refusal([*faults, *_mistyped(err)], where) from err
    if faults := faults or beyond_their_ends(rig):
        raise _refusal(faults, where)
    for fault in contradictions(rig):
        raise _refusal([fault], where)
    return rig


def _refusal(faults: list[Fault], where: str) -> RigError:
    """Of one fault, or of several that do not follow from each other."""
    if len(faults) == 1:
        field, what, fix = faults[0]
        return RigError(what, where=f"{where}: {field}" if field else where, fix=fix)
    told = ", ".join(f"{field}: {what}" for field, what, _ in faults)
    return RigError(told, where=where, fix=COMPARE)


def _mistyped(err: ValidationError) -> Iterator[Fault]:
    """What is missing or of another type."""
    for one in err.errors(include_url=False, include_context=False):
        message, given = one["msg"].removeprefix("Value error, "), one["input"]
        what = message if isinstance(given, dict) else f"{message}, got {given!r:.60}"
        yield Fault(".".join(map(str, one["loc"])), what)


def _unknown(kind: type[RigSection], written: Any, way: str = "") -> Iterator[Fault]:
    """Fields that a section does not have, each with the likeliest that it has."""
    for name, value in written.items() if isinstance(written, dict) else ():
        if name in kind.model_fields:
            yield from _unknown_within(kind.model_fields[name].annotation, value, f"{way}{name}")
            continue
        likely = get_close_matches(name, kind.model_fields, n=1)
        hint = f"did you mean {likely[0]}?" if likely else f"known: {', '.join(kind.model_fields)}"
        yield Fault(f"{way}{name}", f"no such field ({hint})")


def _unknown_within(annotation: Any, written: Any, name: str) -> Iterator[Fault]:
    if isinstance(annotation, type) and issubclass(annotation, RigSection):
        yield from _unknown(annotation, written, f"{name}.")
    elif isinstance(written, list | tuple):
        for k, (part, kind) in enumerate(zip(written, get_args(annotation), strict=False)):
            yield from _unknown_within(kind, part, f"{name}.{k}")


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
