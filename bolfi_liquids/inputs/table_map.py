"""What the columns of a table mean: `columns.toml`, written by a person."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from .fields import AXES, DENSITIES, LENGTHS, PLANES, STICK_WEIGHT
from .toml_file import read_toml

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
RADIANS = {"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295}
DENSITY = {"kg/m3": 1.0, "g/cm3": 1e3, "g/ml": 1e3}
MASS = {"kg": 1.0, "g": 1e-3}
SPEED = {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3}

COLUMN_UNITS = {"time": SECONDS} | dict.fromkeys(AXES, METRES) | dict.fromkeys(PLANES, RADIANS)
ATTRIBUTE_UNITS = (
    dict.fromkeys(LENGTHS, METRES)
    | dict.fromkeys(DENSITIES, DENSITY)
    | {"stick_density": DENSITY, "stick_mass": MASS, "speed": SPEED}
)


class Given(BaseModel):
    """Base of the file's tables. Unknown names and wrong types are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Column(Given):
    """A column of the table: (its number + offset) x unit, with an optional change of sign.

    Attributes:
        column: Its name in the header.
        unit: Of its numbers.
        offset: Added to them, in `unit`.
        flip: Whether to change the sign.
    """

    column: str
    unit: str
    offset: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    flip: bool = False

    def in_si(self, name: str, numbers: NDArray) -> NDArray[np.float64]:
        """What its numbers are in a recording, as the field `name`."""
        factor = COLUMN_UNITS[name][self.unit]
        return (-factor if self.flip else factor) * (numbers + self.offset)


class Quantity(Given):
    """A number and its unit."""

    value: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
    unit: str


class TableMap(Given):
    """How to read a recording out of a table.

    Attributes:
        delimiter: Between two cells; None is found in the header.
        decimal: In a number; None is found in the cells.
        skip: Lines before the header.
        columns: Of `time`, `x`, `y`, `z`, `inclination_xz` and `inclination_yz`.
        attributes: Sizes and densities.
        yaw_deg: By which x and y are turned, counterclockwise seen from above, to lie in the
            cameras' planes [deg].
        source: Where the data come from.
    """

    delimiter: Annotated[str, Field(min_length=1, max_length=1)] | None = None
    decimal: Literal[".", ","] | None = None
    skip: Annotated[int, Field(ge=0)] = 0
    columns: dict[str, Column]
    attributes: dict[str, Quantity]
    yaw_deg: Annotated[float, Field(ge=-360.0, le=360.0, allow_inf_nan=False)] = 0.0
    source: str = "imported"

    @model_validator(mode="after")
    def _complete(self) -> "TableMap":
        _check_names("columns", self.columns, COLUMN_UNITS, needed=tuple(COLUMN_UNITS))
        _check_names("attributes", self.attributes, ATTRIBUTE_UNITS, needed=LENGTHS + DENSITIES)
        weighed = [name for name in STICK_WEIGHT if name in self.attributes]
        if len(weighed) != 1:
            has = "both are given" if weighed else "is missing"
            raise ValueError(f"attributes: one of {' and '.join(STICK_WEIGHT)}; {has}")
        owners: dict[str, str] = {}
        for name, one in self.columns.items():
            if (other := owners.setdefault(one.column, name)) != name:
                raise ValueError(f"columns.{name} and columns.{other} are both {one.column!r}")
        return self

    def turned(self, values: dict[str, NDArray]) -> dict[str, NDArray]:
        """Values of a recording, by name, with x and y turned by `yaw_deg`."""
        if self.yaw_deg == 0.0:
            return values
        way = np.exp(1j * np.radians(self.yaw_deg)) * (values["x"] + 1j * values["y"])
        return values | {"x": way.real, "y": way.imag}


def open_table_map(path: str | Path) -> TableMap:
    """Read what a person wrote down about a table.

    Raises:
        InputError: The file is missing or cannot be used; the message names the field.
    """
    return read_toml(
        path, TableMap, fix="compare with what `bolfi-liquids import --template` writes"
    )


def _check_names(
    table: str,
    given: dict[str, Column] | dict[str, Quantity],
    units: dict[str, dict[str, float]],
    needed: tuple[str, ...],
) -> None:
    for name, one in given.items():
        if name not in units:
            raise ValueError(f"{table}.{name} is none of {', '.join(units)}")
        if one.unit not in units[name]:
            known = ", ".join(units[name])
            raise ValueError(f"{table}.{name}.unit = {one.unit!r} is none of {known}")
    missing = [name for name in needed if name not in given]
    if missing:
        raise ValueError(f"{table}: {', '.join(missing)} missing")
