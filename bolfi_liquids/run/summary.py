"""summary.json: the numbers of a run, a section for each command."""

import json
import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, TypeAdapter, ValidationError

from ..errors import InputError
from ..files import write_text
from ..numerals import load_json

SUMMARY_FILE = "summary.json"
HOW_TO_RESTORE = (
    "delete it; calibrate --resume, criticise and pour write it again from what was simulated"
)

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A number that may be NaN, for which JSON has `null`."""


class Section:
    """A section of summary.json; its subclasses are frozen dataclasses that list the fields."""

    SECTION: ClassVar[str]
    """Of the section, which is that of the command."""

    @classmethod
    def from_json(cls, values: Mapping[str, Any], where: str = SUMMARY_FILE) -> Self:
        """The section from what `json.loads` read.

        Raises:
            InputError: A field is missing or is not what it should be; `where` is named.
        """
        try:
            return _adapter(cls).validate_python(values)
        except ValidationError as err:
            first = err.errors(include_url=False)[0]
            field = ".".join(map(str, (cls.SECTION, *first["loc"])))
            what = f"{field}: {first['msg']} (in a section that {made_by(values)} wrote)"
            raise InputError(what, where=where, fix=HOW_TO_RESTORE) from err

    def to_json(self) -> dict[str, Any]:
        """The section as `json.dumps` takes it."""
        return _adapter(type(self)).dump_python(self, mode="json", by_alias=True)

    @classmethod
    def read(cls, run: Path) -> Self | None:
        """The section of a run; None if it has none.

        Raises:
            InputError: The file is damaged.
        """
        section = read_summary(run).get(cls.SECTION)
        return None if section is None else cls.from_json(section, str(run / SUMMARY_FILE))

    def write(self, run: Path) -> None:
        """Replace the section of a run."""
        write_section(run, self.SECTION, self.to_json())


def made_by(section: Mapping[str, Any]) -> str:
    """The version that wrote a section, for messages."""
    made_from = section.get("made_from")
    inner = made_from.get("version") if isinstance(made_from, Mapping) else None
    version = section.get("version", inner)
    return "an unknown version" if version is None else f"version {version}"


@cache
def _adapter(kind: type) -> TypeAdapter:
    return TypeAdapter(kind)


def read_summary(run: Path) -> dict[str, Any]:
    """All sections written so far; empty where there is no file yet.

    Raises:
        InputError: The file is not JSON, or holds a number that is not finite.
    """
    path = run / SUMMARY_FILE
    if not path.exists():
        return {}
    try:
        summary = load_json(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as err:
        raise InputError("not UTF-8 text", where=str(path), fix=HOW_TO_RESTORE) from err
    except (ValueError, RecursionError) as err:
        raise InputError(f"not JSON ({err})", where=str(path), fix=HOW_TO_RESTORE) from err
    if not isinstance(summary, dict) or not all(isinstance(s, dict) for s in summary.values()):
        raise InputError("holds no sections", where=str(path), fix=HOW_TO_RESTORE)
    return summary


def write_section(run: Path, name: str, section: dict[str, Any]) -> None:
    """Replace one section and leave the others as they are; the file is never half written."""
    summary = read_summary(run) | {name: _finite(section)}
    write_text(run / SUMMARY_FILE, json.dumps(summary, indent=2, allow_nan=False) + "\n")


def _finite(value):
    """JSON has no NaN: what could not be computed (R-hat of one chain) becomes null."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
