"""Numbers that a rig.toml may hold: each with a lower and an upper end, its unit, and why.

The ends keep an arm from doing harm. They are checked where a rig.toml is opened and before a
session starts, by `CHECK_ENDS` as the context of the validation; the rig of a recording, by which
nothing moves any more, is read without them.
"""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import BaseModel, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

CHECK_ENDS = "check ends"
COMPARE = "compare with the bundled rig.toml (SI units unless the name says otherwise)"


class RigSection(BaseModel, frozen=True, allow_inf_nan=False):
    """Part of a rig.toml; no change after reading."""


class RigFault(NamedTuple):
    """A fault of a rig.

    Attributes:
        field: Such as `robot.host`; empty if several fields are involved.
        what: Description, with the values.
        fix: Cure.
    """

    field: str
    what: str
    fix: str = COMPARE


@dataclass(frozen=True)
class Within:
    """Ends of a number, both allowed, its unit and the reason; annotates the number's field."""

    low: float
    high: float
    unit: str
    why: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_after_validator_function(self._checked, handler(source))

    def _checked(self, value: Any, info: ValidationInfo) -> Any:
        """The value; a text or None, where the field allows that, has no ends."""
        is_number = isinstance(value, int | float)
        if info.context == CHECK_ENDS and is_number and not self.low <= value <= self.high:
            unit = f" {self.unit}".rstrip()
            ends = f"{self.low:g} to {self.high:g}{unit}"
            raise ValueError(f"{value:g}{unit} is not within {ends}: {self.why}")
        return value


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
