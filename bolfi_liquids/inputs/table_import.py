"""Recordings made elsewhere: a table of numbers becomes a NetCDF file that can be simulated."""

import hashlib
import logging
from collections.abc import Iterator
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Argument, InputError
from ..files import given_path, new_netcdf, write_netcdf, write_text
from .checks import MAX_GRIPPER_GAP, MIN_SEEN, check_hangs, check_values
from .fields import (
    AXES,
    DENSITIES,
    LENGTHS,
    PLANES,
)
from .frame import found_turn, frame_faults, trailing
from .open import read_recording
from .recording import Recording, as_recording, recording_dataset
from .start import check_start
from .strokes import speed
from .table import Table, read_table
from .table_map import ATTRIBUTE_UNITS, TableMap, open_table_map

if TYPE_CHECKING:
    from xarray import Dataset

logger = logging.getLogger(__name__)

TEMPLATE = "columns.toml"
OTHER_NAME = "choose another name"
STICK_WEIGHT_UNITS = {"stick_density": "kg/m3", "stick_mass": "kg"}
REGULAR_SHARE = 0.8  # of a camera's rows that follow at its rate; a camera misses some
SLOWER = 1.5  # times a step of a log: a longer one is another's, or leaves a row out
HEADER_FIX = "correct the map: `column`, `skip` or `delimiter`, or leave `delimiter` out"


def write_template(path: str | Path) -> Path:
    """Write a map to be changed into one's own.

    Raises:
        InputError: There is a file of that name.
    """
    path = given_path(path, Argument("path"))
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
    out = given_path(out, Argument("out"))
    meaning = columns if isinstance(columns, TableMap) else open_table_map(columns)
    read = read_table(
        table, delimiter=meaning.delimiter, decimal=meaning.decimal, skip=meaning.skip
    )
    dataset, told = _dataset(read, meaning)
    made = as_recording(dataset, read.path, b"")
    try:
        check_values(made)
        check_hangs(made)
    except InputError as err:
        if "convert" not in err.fix:
            raise
        raise InputError(
            err.what, where=err.where, fix=f"{err.fix} (or the unit, in the map)"
        ) from err
    _check_target(out)
    write_netcdf(dataset, out)
    if told:
        logger.info("%s: %s", read.path, told)
    if unused := read.others(column.column for column in meaning.columns.values()):
        logger.info("%s: columns not used: %s", read.path, ", ".join(unused))
    return read_recording(out)


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


def _dataset(table: Table, meaning: TableMap) -> "tuple[Dataset, str]":
    """The recording, and what was done to its rows; "" if nothing was."""
    values = {
        name: column.in_si(name, table.numbers(column.column, fix=HEADER_FIX))
        for name, column in meaning.columns.items()
    }
    attributes = {
        name: given.value * ATTRIBUTE_UNITS[name][given.unit]
        for name, given in meaning.attributes.items()
    }
    made = {
        "Conventions": "CF-1.11",
        "source": meaning.source,
        "imported_from": table.path.name,
        "imported_sha256": hashlib.sha256(table.path.read_bytes()).hexdigest(),
        "imported_with": f"bolfi-liquids {version('bolfi-liquids')}: {meaning.model_dump_json()}",
    }
    values, told = at_camera_times(values)
    if told:
        made["history"] = told
    return recording_dataset(meaning.turned(values), attributes | made), told


def at_camera_times(values: dict[str, NDArray]) -> tuple[dict[str, NDArray], str]:
    """A robot's rows with a camera's slower ones between them, as rows of the camera alone.

    Two logs that are merged by their times have empty cells wherever one of them has no row. The
    gripper moves a few millimetres between two rows of its own, and is interpolated linearly; an
    inclination never is.

    Args:
        values: By field of a recording, of equal shape (rows,); NaN where a cell is empty.

    Returns:
        The values, and what was done; the same values and "" where the rows are of one kind.
    """
    time = values["time"]
    seen = np.isfinite(values[PLANES[0]]) | np.isfinite(values[PLANES[1]])
    if not _is_merged(time, seen):
        return values, ""
    known = {axis: np.isfinite(values[axis]) for axis in AXES}
    kept = {name: one[seen] for name, one in values.items()}
    for axis in AXES:
        own = time[known[axis]]
        if len(own):
            filled = np.interp(kept["time"], own, values[axis][known[axis]], np.nan, np.nan)
            after = np.clip(np.searchsorted(own, kept["time"]), 1, max(len(own) - 1, 1))
            far = np.diff(own, append=np.inf)[after - 1] > MAX_GRIPPER_GAP
            kept[axis] = np.where(far & np.isnan(kept[axis]), np.nan, filled)
    told = (
        f"{', '.join(AXES)} were interpolated to the {seen.sum()} of {len(time)} times at which "
        f"{' or '.join(PLANES)} is given"
    )
    return kept, told


def _is_merged(time: NDArray, seen: NDArray[np.bool_]) -> bool:
    """Whether the rows with an inclination are few, and come as regularly as a camera's do."""
    if not seen.any() or seen.mean() >= MIN_SEEN:
        return False
    if not np.isfinite(time).all() or (np.diff(time) <= 0.0).any():
        return False
    steps = np.diff(time[seen])
    if not len(steps) or np.median(steps) < SLOWER * np.median(np.diff(time)):
        return False
    return float(np.mean(steps < SLOWER * np.median(steps))) >= REGULAR_SHARE


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
    return "\n".join([*lines, *_trailing(recording), *_start(recording)])


def _sizes(recording: Recording) -> Iterator[str]:
    for name in LENGTHS:
        yield f"{name} {100 * recording.number(name):.4g} cm"
    for name, unit in {**dict.fromkeys(DENSITIES, "kg/m3"), **STICK_WEIGHT_UNITS}.items():
        if name in recording.attrs:
            yield f"{name} {recording.number(name):.4g} {unit}"


def _trailing(recording: Recording) -> Iterator[str]:
    """Correlation of inclinations and gripper, and a warning where their frames differ."""
    for name, axis, follows in zip(PLANES, AXES, trailing(recording), strict=False):
        if np.isfinite(follows):
            yield (
                f"{name}: correlation with the movement along {axis} {follows:+.2f} "
                "(usual: -0.4 to -1)"
            )
    if (turn := found_turn(recording)) is not None and not turn.mirrored:
        yield f"turn between inclination and gripper: {turn}"
    yield from (f"warning: {fault}" for fault in frame_faults(recording))


def _start(recording: Recording) -> Iterator[str]:
    """A warning where `calibrate` would refuse how it starts."""
    try:
        check_start(recording)
    except InputError as err:
        yield f"warning: {err}"
