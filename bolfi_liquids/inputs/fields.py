"""Which fields, units and attributes a recording's file must have."""

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from xarray import Dataset

AXES = ("x", "y", "z")
PLANES = ("inclination_xz", "inclination_yz")
PLANE_NAMES = ("xz", "yz")
LENGTHS = ("cup_radius", "cup_height", "fill", "stick_radius", "stick_length")
DENSITIES = ("liquid_density",)
STICK_WEIGHT = ("stick_density", "stick_mass")

_SECONDS = ("s", "sec", "second", "seconds")
_METRES = ("m", "metre", "metres", "meter", "meters")
_RADIANS = ("rad", "radian", "radians")
UNITS = {"time": _SECONDS} | dict.fromkeys(AXES, _METRES) | dict.fromkeys(PLANES, _RADIANS)
"""Spellings of each variable's unit, the one that is written first."""


def check_fields(dataset: "Dataset", path: Path) -> None:
    """Raise `InputError` unless every field and attribute is there, in SI units."""
    for name, units in UNITS.items():
        _check_variable(dataset, name, units, path)
    for name in LENGTHS + DENSITIES:
        if name not in dataset.attrs:
            raise InputError(
                "missing", where=f"{path}: attribute {name}", fix="add it to the file, in SI units"
            )
    if not any(name in dataset.attrs for name in STICK_WEIGHT):
        raise InputError(
            "missing",
            where=f"{path}: attribute {' or '.join(STICK_WEIGHT)}",
            fix="add one of them, in kg/m3 or kg",
        )


def _check_variable(dataset: "Dataset", name: str, units: tuple[str, ...], path: Path) -> None:
    where = f"{path}: {name}"
    if name not in dataset.variables:
        held = ", ".join(sorted(map(str, dataset.variables))) or "no variables"
        raise InputError(
            f"missing (the file holds {held})",
            where=where,
            fix="a recording needs " + ", ".join(UNITS),
        )
    variable = dataset[name]
    if variable.dims != ("time",):
        raise InputError(
            f"has dimensions {variable.dims}", where=where, fix="it must have the dimension time"
        )
    unit = str(variable.attrs.get("units", units[0]))
    if " since " in unit:
        raise InputError(
            f"holds dates, {variable.dtype} in {unit!r}",
            where=where,
            fix=f"store the time since the first sample in {units[0]}, as float64",
        )
    if variable.dtype.kind != "f":  # complex numbers lose a part, whole ones what they measured
        raise InputError(
            f"holds {variable.dtype} in {unit!r}, not decimal numbers",
            where=where,
            fix=f"store it in {units[0]}, as float64",
        )
    if unit not in units:
        raise InputError(
            f"has units {unit!r}",
            where=where,
            fix=f"convert it to {units[0]} and set units to {units[0]!r}",
        )
