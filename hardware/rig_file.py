"""Reading a rig.toml, and the one that comes with the package."""

import tomllib
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from importlib.resources import as_file, files
from pathlib import Path
from types import NoneType
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from .errors import RigError
from .rig import Rig
from .rig_checks import contradictions
from .rig_numbers import CHECK_ENDS, COMPARE, RigFault

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
    """Rig of a file's content, after all checks."""
    try:
        rig = Rig.model_validate(written, context=CHECK_ENDS, extra="forbid")
    except ValidationError as err:
        what, place = named_faults(field_faults(err, Rig), where)
        raise RigError(what, where=place, fix=COMPARE) from err
    for field, what, fix in contradictions(rig):
        raise RigError(what, where=f"{where}: {field}" if field else where, fix=fix)
    return rig


def named_faults(faults: Iterable[RigFault], where: str) -> tuple[str, str]:
    """What is wrong and where, of one fault or of several independent ones."""
    several = [*faults]
    if len(several) > 1:
        return ", ".join(f"{field}: {what}" for field, what, _ in several), where
    ((field, what, _),) = several
    return what, f"{where}: {field}" if field else where


def field_faults(err: ValidationError, model: type[BaseModel]) -> Iterator[RigFault]:
    """Missing and unknown fields, wrong types, numbers beyond their ends.

    Args:
        err: Of the values of a file.
        model: What they should have been.
    """
    for one in err.errors(include_url=False, include_context=False):
        name, given = ".".join(map(str, one["loc"])), one["input"]
        what = one["msg"].removeprefix("Value error, ")
        if one["type"] == "missing":
            what = "is required, but missing"
        elif one["type"] == "extra_forbidden":
            *way, unknown = one["loc"]
            known = _section(model, way).model_fields
            likely = get_close_matches(str(unknown), known, n=1)
            hint = f"did you mean {likely[0]}?" if likely else f"known: {', '.join(known)}"
            what = f"no such field ({hint})"
        elif one["type"] != "value_error" and not isinstance(given, dict):
            what = f"{what}, got {given!r:.60}"
        yield RigFault(name, what)


def _section(model: type[BaseModel], way: list[int | str]) -> type[BaseModel]:
    """The part of a model to which names of fields, and indices into tuples, lead."""
    kind: Any = model
    for step in way:
        if isinstance(step, int):
            kinds = get_args(kind)
            kind = kinds[0] if kinds[-1] is ... else kinds[step]
        else:
            kind = kind.model_fields[step].annotation
        kinds = get_args(kind)
        kind = kinds[0] if kinds[1:] == (NoneType,) else kind
    return kind


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
