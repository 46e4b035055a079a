"""summary.json: the numbers of a run, a section for each command, for people and other programs.

Nothing here reads it: each result carries its own section.
"""

import json
import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, TypeAdapter

from ..files import write_text

SUMMARY_FILE = "summary.json"

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A number that may be NaN, for which JSON has `null`."""


class Section:
    """A section of summary.json; its subclasses are frozen dataclasses that list the fields."""

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Self:
        """The section that `to_json` gave."""
        return _adapter(cls).validate_python(values)

    def to_json(self) -> dict[str, Any]:
        """The section as `json.dumps` takes it; what is not finite (R-hat of one chain) is None."""
        return json.loads(_adapter(type(self)).dump_json(self, by_alias=True))


@cache
def _adapter(kind: type) -> TypeAdapter:
    return TypeAdapter(kind)


def write_summary(path: Path, sections: Mapping[str, Any]) -> None:
    """Write all sections, by the names of their commands."""
    write_text(path, json.dumps(sections, indent=2, allow_nan=False) + "\n")
