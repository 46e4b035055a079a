"""Recordings made elsewhere: a table of numbers becomes a NetCDF file that can be simulated."""

import hashlib
from collections.abc import Iterator
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import (
    existing_file,
    given_path,
    new_netcdf,
    write_netcdf,
    write_text,
)
from .checks import check_values
from .fields import (
    AXES,
    DENSITIES,
    LENGTHS,
    PLANES,
)
from .open import open_recording
from .recording import Recording, as_recording, recording_dataset
from .strokes import speed
from .table import read_table
from .table_map import ATTRIBUTE_UNITS, TableMap, open_table_map

if TYPE_CHECKING:
    from xarray import Dataset

TEMPLATE = "columns.toml"
OTHER_NAME = "choose another name"
STICK_WEIGHT_UNITS = {"stick_density": "kg/m3", "stick_mass": "kg"}
MIN_TRAVEL = 5e-3  # of the gripper [m], on which an inclination can be seen to trail
MAX_CORRELATION = 0.2  # between a stick that trails and the gripper; thin liquids let it swing
HEADER_FIX = "correct the map: `column`, `skip` or `delimiter`, or leave `delimiter` out"


def write_template(path: str | Path) -> Path:
    """Write a map to be changed into one's own.

    Raises:
        InputError: There is a file of that name.
    """
    path = given_path(path, "--template")
    if path.exists():
        raise InputError("exists already", where=str(path), fix=OTHER_NAME)
    return write_text(path, (files("bolfi_liquids.data") / TEMPLATE).read_text(encoding="utf-8"))


def import_table(table: str | Path, columns: str | Path | TableMap, out: str | Path) -> Recording:
    """Write a recording from a table, once it is sure that it can be simulated.

    Args:
        table: Text with a header and a row for each sample, such as CSV. Empty cells are missing
            samples.
        columns: What its columns mean; a TOML file or what `open_table_map` gives.
        out: The NetCDF file to write; one that an import has made is replaced.

    Raises:
        InputError: The table or the map cannot be used; the message names line, column and value.
            Or `out` is something else that is there already. Nothing was written.
    """
    table, out = existing_file(table), given_path(out, "--out")
    meaning = columns if isinstance(columns, TableMap) else open_table_map(columns)
    dataset = _dataset(table, meaning)
    try:
        check_values(as_recording(dataset, table))
    except InputError as err:
        if "looks like" not in err.what:
            raise
        raise InputError(
            err.what, where=err.where, fix=f"{err.fix} (or the unit, in the map)"
        ) from err
    _check_target(out)
    write_netcdf(dataset, out)
    return open_recording(out)


def _check_target(out: Path) -> None:
    """Refuse to write over anything but an earlier import."""
    new_netcdf(out)
    if out.exists() and "imported_from" not in _attributes(out):
        raise InputError("exists already, and is no import", where=str(out), fix=OTHER_NAME)


def _attributes(path: Path) -> dict[str, Any]:
    """Attributes of a NetCDF file; none if it is something else."""
    from xarray import open_dataset

    try:
        with open_dataset(path, engine="h5netcdf", decode_times=False) as dataset:
            return {str(name): value for name, value in dataset.attrs.items()}
    except (OSError, ValueError):
        return {}


def _dataset(table: Path, meaning: TableMap) -> "Dataset":
    cells = _cells(table, meaning)
    values = {
        name: column.in_si(name, cells[column.column]) for name, column in meaning.columns.items()
    }
    attributes = {
        name: given.value * ATTRIBUTE_UNITS[name][given.unit]
        for name, given in meaning.attributes.items()
    }
    made = {
        "Conventions": "CF-1.11",
        "source": meaning.source,
        "imported_from": table.name,
        "imported_sha256": hashlib.sha256(table.read_bytes()).hexdigest(),
        "imported_with": f"bolfi-liquids {version('bolfi-liquids')}: {meaning.model_dump_json()}",
    }
    return recording_dataset(values, attributes | made)


def _cells(path: Path, meaning: TableMap) -> dict[str, NDArray[np.float64]]:
    """The columns that the map names, as numbers; missing samples are NaN."""
    table = read_table(
        path, delimiter=meaning.delimiter, decimal=meaning.decimal, skip=meaning.skip
    )
    wanted = dict.fromkeys(column.column for column in meaning.columns.values())
    return {name: table.numbers(name, fix=HEADER_FIX) for name in wanted}


def outline(recording: Recording) -> str:
    """What was read, in a few lines that show a wrong unit or sign at a glance.

    A stirred stick trails: where the gripper is ahead of the cup's axis its tip is behind, so
    the inclination in a plane goes against the gripper's position there.
    """
    time, path = recording.time, recording.gripper.position
    reach, fastest = np.nanmax(path, axis=0) - np.nanmin(path, axis=0), np.nanmax(speed(recording))
    lines = [
        f"{recording.path}: {len(time)} samples over {time[-1] - time[0]:.2f} s, "
        f"{1.0 / np.median(np.diff(time)):.1f} Hz",
        f"gripper: {100 * reach[0]:.1f} x {100 * reach[1]:.1f} cm, "
        f"{100 * np.nanmean(path[:, 2]):.1f} cm above the cup's floor, "
        f"up to {100 * fastest:.1f} cm/s",
    ]
    lines += [
        f"{name}: {np.nanmin(angle):+.1f} to {np.nanmax(angle):+.1f} deg, "
        f"seen in {np.isfinite(angle).mean():.1%} of the samples"
        for name, angle in zip(PLANES, np.degrees(recording.inclination.T), strict=True)
    ]
    lines.append(", ".join(_sizes(recording)))
    return "\n".join([*lines, *_trailing(recording)])


def _sizes(recording: Recording) -> Iterator[str]:
    for name in LENGTHS:
        yield f"{name} {100 * recording.number(name):.4g} cm"
    for name, unit in {**dict.fromkeys(DENSITIES, "kg/m3"), **STICK_WEIGHT_UNITS}.items():
        if name in recording.attrs:
            yield f"{name} {recording.number(name):.4g} {unit}"


def _trailing(recording: Recording) -> Iterator[str]:
    """Correlation of inclinations and gripper, and a warning where it is unusual."""
    for name, angle, at in zip(PLANES, recording.inclination.T, (0, 1), strict=True):
        along, across = (
            _correlation(angle, recording.gripper.position[:, axis]) for axis in (at, 1 - at)
        )
        if not np.isfinite(along):
            continue
        yield f"{name}: correlation with the gripper's {AXES[at]} {along:+.2f} (usual: -0.4 to -1)"
        if along > MAX_CORRELATION:
            yield f"warning: {name}: the stick leans ahead of the gripper; is `flip` right?"
        elif abs(along) < abs(across):
            yield (
                f"warning: {name}: the stick follows {AXES[1 - at]} ({across:+.2f}) more than "
                f"{AXES[at]}; are the planes exchanged?"
            )


def _correlation(angle: NDArray, position: NDArray) -> float:
    """NaN where the gripper hardly moves that way."""
    seen = np.isfinite(angle) & np.isfinite(position)
    if np.ptp(position[seen]) < MIN_TRAVEL or np.ptp(angle[seen]) == 0.0:
        return float("nan")
    return float(np.corrcoef(angle[seen], position[seen])[0, 1])
