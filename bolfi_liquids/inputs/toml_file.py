"""Things that a person gives as a value or as the file that holds it, and TOML files."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ..errors import InputError
from ..files import existing_file

NO_TOML = "correct that line, or save the file as UTF-8 text"


def opened[Kind](
    given: Kind | str | Path,
    kind: type[Kind],
    open_file: Callable[[str | Path], Kind],
    where: str,
    noun: str,
    cure: str,
) -> Kind:
    """A value as it is, or what a file holds.

    Args:
        given: The value, or the path of the file.
        kind: Of the value.
        open_file: Reads such a file.
        where: The argument, for a refusal.
        noun: What the value is, likewise.
        cure: What to give, likewise.

    Raises:
        InputError: It is something else, or the file cannot be used.
    """
    if isinstance(given, kind):
        return given
    if isinstance(given, str | Path):
        return open_file(given)
    raise InputError(f"{given!r:.80} is no {noun}", where=where, fix=f"give {cure}")


def read_toml[Model: BaseModel](path: str | Path, model: type[Model], fix: str) -> Model:
    """Read a file and check it.

    Args:
        path: The file.
        model: What it must hold.
        fix: What a person can do about a field that is wrong.

    Raises:
        InputError: The file is missing or cannot be used; the message names the fields.
    """
    path = existing_file(path)
    try:
        written = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as err:
        raise InputError(f"not TOML: {err}", where=str(path), fix=NO_TOML) from err
    return validated(written, model, str(path), fix)


def validated[Model: BaseModel](
    written: dict[str, Any], model: type[Model], where: str, fix: str
) -> Model:
    """A model of values that a person wrote.

    Args:
        written: The values by name, tables within each other.
        model: What they must be.
        where: The file, or the argument.
        fix: What a person can do about a field that is wrong.

    Raises:
        InputError: A field is missing, unknown or wrong; all of them are named.
    """
    try:
        return model.model_validate(written)
    except ValidationError as err:
        from ..hardware.rig_file import field_faults, named_faults

        what, place = named_faults(field_faults(err, model), where)
        raise InputError(what, where=place, fix=fix) from err
