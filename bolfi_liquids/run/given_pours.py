"""Pours of its liquid that a run was given: they count in every pour that it chooses.

Whichever command is given a table (`calibrate`, `criticise` or `pour`) keeps it here, in the place
of an earlier one.
"""

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..inputs.pour_table import PourTable
from .results import read_result, write_result

if TYPE_CHECKING:
    from xarray import Dataset

    from ..models import Cups

GIVEN_POURS = "given_pours.nc"
FRACTIONS = ("spilled", "received", "retained")
UNITS = {"angular_velocity": "rad s-1", "distance": "m", **dict.fromkeys(FRACTIONS, "1")}


def keep_pours(run: Path, table: PourTable, cups: "Cups") -> None:
    """Replace the run's table of pours."""
    from xarray import Dataset, DataTree

    values = [table.angular_velocity, table.distance, *table.fractions.T]
    columns = {
        name: ("row", of, {"units": unit})
        for (name, unit), of in zip(UNITS.items(), values, strict=True)
    }
    attributes = {
        "file": table.path.name,
        "liquid": table.liquid,
        "sha256": table.hash,
        "cups": json.dumps(_scene(cups)),
    }
    coordinates = {"line": ("row", table.lines)}
    write_result(DataTree(Dataset(columns, coordinates, attributes)), run / GIVEN_POURS)


def kept_pours(run: Path, cups: "Cups") -> PourTable | None:
    """The pours that the run was given, if they were made with these cups; None without any.

    Raises:
        InputError: The file is damaged.
    """
    held = _held(run)
    if held is None or json.loads(held.attrs["cups"]) != _scene(cups):
        return None
    return PourTable(
        path=Path(held.attrs["file"]),
        liquid=held.attrs["liquid"],
        angular_velocity=held["angular_velocity"].to_numpy(),
        distance=held["distance"].to_numpy(),
        fractions=np.column_stack([held[name] for name in FRACTIONS]),
        lines=held["line"].to_numpy(),
        hash=held.attrs["sha256"],
    )


def digest_of_pours(run: Path) -> str:
    """Digest of the table that the run was given, of its liquid's name and cups; "" without one.

    That of a damaged file equals no other.
    """
    try:
        held = _held(run)
    except InputError as err:
        return str(err)
    if held is None:
        return ""
    told = [held.attrs[name] for name in ("sha256", "liquid", "cups")]
    return hashlib.sha256(json.dumps(told).encode()).hexdigest()


def _held(run: Path) -> "Dataset | None":
    path = run / GIVEN_POURS
    if not path.is_file():
        return None
    try:
        return read_result(path).to_dataset()
    except (OSError, ValueError) as err:
        fix = "delete it, and give the table of pours again"
        raise InputError("is damaged", where=str(path), fix=fix) from err


def _scene(cups: "Cups") -> dict[str, Any]:
    """The cups without the ranges of the action."""
    ranges = {"angular_velocity_deg_s", "distance"}
    return json.loads(cups.model_dump_json(exclude={"pour": ranges}))
