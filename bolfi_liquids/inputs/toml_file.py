"""TOML files that a person writes, as models of pydantic."""

import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

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

        likely = _likely(err, model)
        raise InputError.from_validation(err, where=where, fix=likely or fix) from err


def _likely(err: ValidationError, model: type[BaseModel]) -> str:
    """A question for the field that an unknown one is probably meant to be; "" without one."""
    unknown = [one["loc"] for one in err.errors() if one["type"] == "extra_forbidden"]
    if not unknown:
        return ""
    *tables, name = map(str, unknown[0])
    owner: Any = model
    for table in tables:
        field = getattr(owner, "model_fields", {}).get(table)
        owner = field and field.annotation
    close = get_close_matches(name, getattr(owner, "model_fields", {}), n=1, cutoff=0.5)
    return f"did you mean {close[0]}?" if close else ""
