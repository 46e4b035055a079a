"""The lists of rig.toml and cups.toml in the guide, from the types that read these files.

`python tests/bolfi_liquids/guide/field_lists.py` writes them again; meanings stay as the page has
them, and everything else follows the types.
"""

import re
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from bolfi_liquids.hardware import Rig, bundled_rig
from bolfi_liquids.models import Cups
from pydantic import BaseModel

from bolfi_liquids.inputs.cups import bundled_cups

PAGE = Path(str(files("bolfi_liquids.guide"))) / "files.md"
LINE = re.compile(r"^- `([\w.]+)`(?: \[[^]]*\])?: (.+?) \([^()]*\)\n", re.M)
FILES = {"rig.toml": (Rig, bundled_rig), "cups.toml": (Cups, bundled_cups)}


def lists(page: str) -> dict[str, str]:
    """The fields of each file, with the meanings of a page."""
    return {name: "".join(_lines(*FILES[name], section(page, name))) for name in FILES}


def section(page: str, name: str) -> str:
    """The part of the page about a file."""
    return re.split(r"^## ", page, flags=re.M)[_headings(page).index(name) + 1]


def _headings(page: str) -> list[str]:
    return re.findall(r"^## (.*)$", page, flags=re.M)


def _lines(model: type[BaseModel], read: Callable[[], BaseModel], part: str) -> Iterator[str]:
    meanings = dict(LINE.findall(part))
    for field, kind, metadata, default, value in _fields(model, read()):
        limits = list(dict.fromkeys(_limits(kind, metadata)))
        units = ", ".join(dict.fromkeys(unit for unit, _ in limits if unit))
        ends = (end for _, end in limits)
        about = "; ".join([*ends, default or f"such as {_written(value)}"])
        yield f"- `{field}`{units and f' [{units}]'}: {meanings.get(field, '')} ({about})\n"


def _fields(
    model: type[BaseModel], example: BaseModel, way: str = ""
) -> Iterator[tuple[str, Any, list[Any], str, Any]]:
    """Dotted name, type, metadata, what is taken without it ("": it is needed), and example."""
    for name, field in model.model_fields.items():
        kind, value = field.annotation, getattr(example, name)
        if isinstance(value, tuple) and isinstance(value[0], BaseModel):
            value = value[0]  # the tables of one array are alike
        if isinstance(value, BaseModel):
            yield from _fields(type(value), value, f"{way}{name}.")
            continue
        default = "" if field.is_required() else f"by default {_written(field.default)}"
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
    return "none" if value is None else f"{value:.6g}"


def write() -> None:
    """Put the lists into the page."""
    page = PAGE.read_text(encoding="utf-8")
    for name, lines in lists(page).items():
        part = section(page, name)
        page = page.replace(part, f"{part.partition('\n- ')[0]}\n{lines}\n")
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    write()
