"""Numbers that a rig.toml may hold: each with a lower and an upper end, and the reason for them."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, Field

MAX_LENGTH = 3.0  # [m]; more looks like millimetres
MAX_MASS = 30.0  # [kg]; more looks like grams


class Section(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """Part of a file that a person writes: no unknown fields, no change after reading."""


def within(low: float, high: float, unit: str, why: str) -> AfterValidator:
    """Refuses a number that is not from `low` to `high`, and says why."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise ValueError(f"{value:g} {unit} is not within {low:g} to {high:g} {unit}: {why}")
        return value

    return AfterValidator(check)


def _in_metres(length: float) -> float:
    if abs(length) > MAX_LENGTH:
        raise ValueError(f"{length:g} m looks like millimetres; convert it to m")
    return length


def _in_kilograms(mass: float) -> float:
    if mass > MAX_MASS:
        raise ValueError(f"{mass:g} kg looks like grams; convert it to kg")
    return mass


Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Coordinate = Annotated[Number, AfterValidator(_in_metres)]
Length = Annotated[Positive, AfterValidator(_in_metres)]
Mass = Annotated[Positive, AfterValidator(_in_kilograms)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Angle = Annotated[float, Field(ge=-2 * np.pi, le=2 * np.pi)]
Turn = tuple[Angle, Angle, Angle]
Degrees = Annotated[float, Field(ge=-360, le=360)]
Speed = Annotated[
    Positive,
    within(
        0.005, 0.25, "m/s", "a slower arm never arrives, a faster one is not safe beside a person"
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
