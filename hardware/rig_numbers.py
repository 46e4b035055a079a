"""Numbers that a rig.toml may hold: each with a lower and an upper end, its unit, and why.

The ends keep an arm from doing harm. They are checked where a rig.toml is opened and before a
session starts; the rig of a recording, by which nothing moves any more, is read without them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, get_args

import numpy as np
from pydantic import BaseModel

COMPARE = "compare with the bundled rig.toml (SI units unless the name says otherwise)"


class RigSection(BaseModel, frozen=True, allow_inf_nan=False):
    """Part of a rig.toml; no change after reading."""


class Fault(NamedTuple):
    """What is wrong with a rig.

    Attributes:
        field: As `robot.host`; empty for what no single one is at fault of.
        what: Is wrong with it.
        fix: What to do about it.
    """

    field: str
    what: str
    fix: str = COMPARE


@dataclass(frozen=True)
class Within:
    """Ends of a number, both allowed; the annotation of its field."""

    low: float
    high: float
    unit: str
    why: str

    def told(self, value: float) -> str:
        """That a value is none of these, and why."""
        unit = f" {self.unit}".rstrip()
        return f"{value:g}{unit} is not within {self.low:g} to {self.high:g}{unit}: {self.why}"


Coordinate = Annotated[float, Within(-3.0, 3.0, "m", "more looks like millimetres")]
Length = Annotated[float, Within(1e-4, 3.0, "m", "more looks like millimetres")]
Mass = Annotated[float, Within(1e-4, 30.0, "kg", "more looks like grams")]
Angle = Annotated[
    float,
    Within(-2 * np.pi, 2 * np.pi, "rad", "a joint turns once at the most; convert degrees to rad"),
]
Degrees = Annotated[float, Within(-360.0, 360.0, "deg", "more than a turn says nothing new")]
Speed = Annotated[
    float,
    Within(
        0.005, 0.25, "m/s", "a slower arm never arrives, a faster one is not safe beside a person"
    ),
]
Acceleration = Annotated[
    float,
    Within(
        0.02, 0.6, "m/s2", "a softer arm needs more way to stop than a box has, a harder one jerks"
    ),
]
Aside = Annotated[float, Within(-0.2, 0.2, "m", "a tool is held near the axis of the flange")]
Ahead = Annotated[
    float,
    Within(0.03, 0.6, "m", "a tool begins in front of the flange and ends within the arm's reach"),
]
MountedAhead = Annotated[float, Within(0.0, 0.4, "m", "what is mounted is in front of the flange")]

Point = tuple[Coordinate, Coordinate, Coordinate]
Turn = tuple[Angle, Angle, Angle]
Tcp = tuple[Aside, Aside, Ahead, Angle, Angle, Angle]
Balance = tuple[Aside, Aside, MountedAhead]


def numbers(section: RigSection, way: str = "") -> Iterator[tuple[str, float, Within | None]]:
    """Each number of a section and of those in it: its field, its value and its ends."""
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


def beyond_their_ends(section: RigSection) -> list[Fault]:
    """The numbers that are not within their ends."""
    return [
        Fault(name, ends.told(value))
        for name, value, ends in numbers(section)
        if ends is not None and not ends.low <= value <= ends.high
    ]
