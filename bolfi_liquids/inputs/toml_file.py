"""TOML files that a person writes, as models of pydantic."""

import tomllib
from pathlib import Path

from pydantic import BaseModel, ValidationError

from ..errors import InputError
from ..files import existing_file


def read_toml[Model: BaseModel](path: str | Path, model: type[Model], fix: str) -> Model:
    """Read a file and check it.

    Args:
        path: The file.
        model: What it must hold.
        fix: What a person can do about a field that is wrong.

    Raises:
        InputError: The file is missing or cannot be used; the message names the field.
    """
    path = existing_file(path)
    try:
        return model.model_validate(tomllib.loads(path.read_text(encoding="utf-8-sig")))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as err:
        raise InputError(f"not TOML: {err}", where=str(path), fix="correct that line") from err
    except ValidationError as err:

        def where(field: str) -> str:
            return f"{path}: {field}" if field else str(path)

        raise InputError.from_validation(err, where=where, fix=fix) from err
