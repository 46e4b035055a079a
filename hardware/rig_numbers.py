"""Numbers that a rig.toml may hold: each with a lower and an upper end, and the reason for them.

The ends keep an arm from doing harm. They do not hold for the rig of a recording that was made, by
which nothing moves any more: it is read with `RECORDED` as its context.
"""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BaseModel, Field, ValidationInfo, model_validator

MAX_LENGTH = 3.0  # [m]; more looks like millimetres
MAX_MASS = 30.0  # [kg]; more looks like grams
RECORDED = {"recorded": True}
"""Context of a validation that asks for the right fields and types, and for no ends."""


def is_recorded(info: ValidationInfo) -> bool:
    """Whether a rig is read back that was recorded."""
    return info.context is not None and info.context == RECORDED


class RigSection(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Part of a file that a person writes: no unknown fields, no change after reading."""

    @model_validator(mode="before")
    @classmethod
    def _known(cls, written: Any, info: ValidationInfo) -> Any:
        """Of a recording without the fields that another version has had."""
        if is_recorded(info) and isinstance(written, dict):
            return {name: value for name, value in written.items() if name in cls.model_fields}
        return written


def unless_recorded(check: Callable[[Any], Any]) -> AfterValidator:
    """A validator of a number that the rig of a recording need not pass."""

    def checked(value: Any, info: ValidationInfo) -> Any:
        return value if is_recorded(info) else check(value)

    return AfterValidator(checked)


def contradiction(check: Callable[[Any], None]) -> Any:
    """A method of a section which refuses numbers that cannot be true together, unless recorded."""

    def checked(self: Any, info: ValidationInfo) -> Any:
        if not is_recorded(info):
            check(self)
        return self

    return model_validator(mode="after")(checked)


def within(low: float, high: float, unit: str, why: str) -> AfterValidator:
    """Refuses a number that is not from `low` to `high`, and says why."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise ValueError(f"{value:g} {unit} is not within {low:g} to {high:g} {unit}: {why}")
        return value

    return unless_recorded(check)


def _in_metres(length: float) -> float:
    if abs(length) > MAX_LENGTH:
        raise ValueError(f"{length:g} m looks like millimetres; convert it to m")
    return length


def _in_kilograms(mass: float) -> float:
    if mass > MAX_MASS:
        raise ValueError(f"{mass:g} kg looks like grams; convert it to kg")
    return mass


def _above_zero(value: float) -> float:
    if value <= 0.0:
        raise ValueError(f"{value:g} is not greater than 0")
    return value


Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[Number, unless_recorded(_above_zero)]
Coordinate = Annotated[Number, unless_recorded(_in_metres)]
Length = Annotated[Positive, unless_recorded(_in_metres)]
Mass = Annotated[Positive, unless_recorded(_in_kilograms)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Angle = Annotated[
    Number,
    within(-2 * np.pi, 2 * np.pi, "rad", "a joint turns once at the most; convert degrees to rad"),
]
Turn = tuple[Angle, Angle, Angle]
Degrees = Annotated[Number, within(-360.0, 360.0, "deg", "more than a turn says nothing new")]
Speed = Annotated[
    Number,
    within(
        0.005, 0.25, "m/s", "a slower arm never arrives, a faster one is not safe beside a person"
    ),
]
Acceleration = Annotated[
    Number,
    within(
        0.02, 0.6, "m/s2", "a softer arm needs more way to stop than a box has, a harder one jerks"
    ),
]

Aside = Annotated[Coordinate, within(-0.2, 0.2, "m", "a tool is held near the axis of the flange")]
Ahead = Annotated[
    Coordinate,
    within(0.03, 0.6, "m", "a tool begins in front of the flange and ends within the arm's reach"),
]
Tcp = tuple[Aside, Aside, Ahead, Angle, Angle, Angle]
Balance = tuple[
    Aside,
    Aside,
    Annotated[Coordinate, within(0.0, 0.4, "m", "what is mounted is in front of the flange")],
]
