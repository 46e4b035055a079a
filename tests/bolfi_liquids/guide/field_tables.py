"""The tables of rig.toml and cups.toml in the guide, from the types that read these files.

`python tests/bolfi_liquids/guide/field_tables.py` writes them again; meanings stay as the page has
them, and everything else follows the types.
"""

import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from bolfi_liquids.hardware import Rig, bundled_rig
from bolfi_liquids.models import Cups
from pydantic import BaseModel

from bolfi_liquids.inputs.cups import bundled_cups

PAGE = Path(str(files("bolfi_liquids.guide"))) / "files.md"
HEAD = "| field | unit | meaning | limits | if left out | example |\n|---|---|---|---|---|---|\n"
ROW = re.compile(r"^\| `([\w.]+)` \|([^|]*)\|([^|]*)\|.*\|$", re.M)
FILES = {"rig.toml": (Rig, bundled_rig), "cups.toml": (Cups, bundled_cups)}


def tables(page: str) -> dict[str, str]:
    """The table of each file, with the meanings of a page."""
    return {
        name: HEAD + "".join(_rows(model, read(), name, page))
        for name, (model, read) in FILES.items()
    }


def section(page: str, name: str) -> str:
    """The part of the page about a file."""
    return re.split(r"^## ", page, flags=re.M)[_headings(page).index(name) + 1]


def _headings(page: str) -> list[str]:
    return re.findall(r"^## (.*)$", page, flags=re.M)


def _rows(model: type[BaseModel], example: BaseModel, name: str, page: str) -> Iterator[str]:
    meanings = {field: told.strip() for field, _, told in ROW.findall(section(page, name))}
    for field, kind, metadata, default, value in _fields(model, example):
        limits = list(dict.fromkeys(_limits(kind, metadata)))
        units = dict.fromkeys(unit for unit, _ in limits if unit)
        ends = "; ".join(end for _, end in limits)
        cells = (
            f"`{field}`",
            ", ".join(units),
            meanings.get(field, ""),
            ends,
            default,
            _written(value),
        )
        yield f"| {' | '.join(cells)} |\n"


def _fields(
    model: type[BaseModel], example: BaseModel, way: str = ""
) -> Iterator[tuple[str, Any, list[Any], str, Any]]:
    """Dotted name, type, metadata, default and example of each field."""
    for name, field in model.model_fields.items():
        kind, value = field.annotation, getattr(example, name)
        if isinstance(value, tuple) and isinstance(value[0], BaseModel):
            value = value[0]  # the tables of one array are alike
        if isinstance(value, BaseModel):
            yield from _fields(type(value), value, f"{way}{name}.")
            continue
        default = "needed" if field.is_required() else _written(field.default)
        yield f"{way}{name}", kind, field.metadata, default, value


def _limits(kind: Any, metadata: Any) -> Iterator[tuple[str, str]]:
    """Unit and limits of each number that a field holds."""
    for one in metadata:
        if hasattr(one, "low"):
            yield one.unit, f"{one.low:.6g} to {one.high:.6g}"
    if get_origin(kind) is Literal:
        yield "", " or ".join(f"`{one}`" for one in get_args(kind))
        return
    for part in get_args(kind):
        if part is not NoneType:
            yield from _limits(part, getattr(part, "__metadata__", ()))


def _written(value: Any) -> str:
    """A value as TOML has it; numbers to six digits."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return f"[{', '.join(map(_written, value))}]"
    return "" if value is None else f"{value:.6g}"


def write() -> None:
    """Put the tables into the page."""
    page = PAGE.read_text(encoding="utf-8")
    for name, table in tables(page).items():
        part = section(page, name)
        before = part.split("| field |")[0]
        page = page.replace(part, f"{before}{table}\n")
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    write()
