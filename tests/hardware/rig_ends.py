"""Each number of a rig with its ends."""

from collections.abc import Iterator
from typing import Any, get_args

from bolfi_liquids.hardware.rig import RigSection, Within


def numbers(section: RigSection, way: str = "") -> Iterator[tuple[str, float, Within | None]]:
    """Field, value and ends of each number of a section and of the sections in it."""
    for name, field in type(section).model_fields.items():
        yield from _numbers(getattr(section, name), field.annotation, field.metadata, way + name)


def _numbers(
    value: Any, annotation: Any, metadata: Any, name: str
) -> Iterator[tuple[str, float, Within | None]]:
    if isinstance(value, RigSection):
        yield from numbers(value, f"{name}.")
    elif isinstance(value, tuple):
        for k, (part, kind) in enumerate(zip(value, get_args(annotation), strict=True)):
            yield from _numbers(part, kind, getattr(kind, "__metadata__", ()), f"{name}.{k}")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield name, value, next((one for one in metadata if isinstance(one, Within)), None)
