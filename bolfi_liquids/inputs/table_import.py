"""Recordings made elsewhere: a table of numbers becomes a NetCDF file that can be simulated."""

import hashlib
import logging
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from ..errors import Argument, InputError
from ..files import new_file, write_netcdf
from .checks import MAX_GRIPPER_GAP, MIN_SEEN, check_values, clock_difference
from .frame import frame_faults
from .open import read_recording
from .recording import AXES, PLANES, STICK_WEIGHT, Recording, as_recording, recording_dataset
from .start import check_start
from .strokes import speed
from .table import Table, read_table
from .toml_file import opened, read_toml

if TYPE_CHECKING:
    from xarray import Dataset

logger = logging.getLogger(__name__)

OTHER_NAME = "choose another name"
SLOWER = 1.5  # times a step of a log: a longer one is another's, or leaves a row out
HEADER_FIX = "correct the map: `column`, `skip` or `delimiter`"
MAP_HINT = "; units, offsets and signs are in the map"
MAP_FIX = "compare with what `bolfi-liquids import --template` writes"
ISO = "2026-11-29T13:05:21.250"
DATES = f'; date and time are read as {ISO} by unit = "iso"'

UNITS = {
    **{"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    **{"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254},
    **{"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295},
    **{"kg/m3": 1.0, "g/cm3": 1e3, "g/ml": 1e3, "kg": 1.0, "g": 1e-3},
    **{"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3},
}
"""What one of each unit is in SI units."""

Seconds = Literal["s", "ms", "us", "ns", "min", "iso"]
Metres = Literal["m", "cm", "mm", "in"]
Radians = Literal["rad", "mrad", "deg"]
Densities = Literal["kg/m3", "g/cm3", "g/ml"]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0.0)]


class Given(BaseModel):
    """Base of the map's tables. Unknown names and wrong types are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Column[Unit: str](Given):
    """A column of the table: (its number + offset) x unit, with an optional change of sign.

    Attributes:
        column: Its name in the header.
        unit: Of its numbers; "iso" is date and time by ISO 8601, in UTC unless a cell has a zone.
        offset: Added to them, in `unit`.
        flip: Whether to change the sign.
    """

    column: str
    unit: Unit
    offset: Finite = 0.0
    flip: bool = False

    def read(self, table: Table) -> NDArray[np.float64]:
        """Its values in SI units, shape (rows,); NaN where one is missing."""
        if self.unit == "iso":
            return _stamps(table, self.column) + self.offset
        factor = UNITS[self.unit]
        remark = DATES if self.unit in get_args(Seconds) else ""
        numbers = table.numbers(self.column, remark=remark)
        return (-factor if self.flip else factor) * (numbers + self.offset)


class Quantity[Unit: str](Given):
    """A number and its unit."""

    value: Positive
    unit: Unit


OneOrSeveral = BeforeValidator(lambda one: tuple(one) if isinstance(one, list | tuple) else (one,))


class Columns(Given):
    """Where each variable of a recording stands; by default under its own name, in SI units.

    Several columns of `time`, such as seconds and nanoseconds, are added.
    """

    time: Annotated[tuple[Column[Seconds], ...], OneOrSeveral, Field(min_length=1)] = (
        Column[Seconds](column="time", unit="s"),
    )
    x: Column[Metres] = Column[Metres](column="x", unit="m")
    y: Column[Metres] = Column[Metres](column="y", unit="m")
    z: Column[Metres] = Column[Metres](column="z", unit="m")
    inclination_xz: Column[Radians] = Column[Radians](column="inclination_xz", unit="rad")
    inclination_yz: Column[Radians] = Column[Radians](column="inclination_yz", unit="rad")

    def by_field(self) -> Iterator[tuple[str, Column[Any]]]:
        """Field of a recording and column of the table, in the order of the file."""
        yield from (("time", one) for one in self.time)
        yield from ((name, getattr(self, name)) for name in (*AXES, *PLANES))

    @model_validator(mode="after")
    def _each_once(self) -> "Columns":
        owners: dict[str, str] = {}
        for name, one in self.by_field():
            if one.column in owners:
                raise ValueError(f"{name} and {owners[one.column]} are both {one.column!r}")
            owners[one.column] = name
        return self


class Attributes(Given):
    """Sizes and densities of cup, stick and liquid."""

    cup_radius: Quantity[Metres]
    cup_height: Quantity[Metres]
    fill: Quantity[Metres]
    stick_radius: Quantity[Metres]
    stick_length: Quantity[Metres]
    liquid_density: Quantity[Densities]
    stick_density: Quantity[Densities] | None = None
    stick_mass: Quantity[Literal["kg", "g"]] | None = None
    speed: Quantity[Literal["m/s", "cm/s", "mm/s"]] | None = None

    def in_si(self) -> dict[str, float]:
        """Those that are given, by the names of a recording's attributes."""
        given = ((name, getattr(self, name)) for name in type(self).model_fields)
        return {name: one.value * UNITS[one.unit] for name, one in given if one is not None}

    @model_validator(mode="after")
    def _one_weight(self) -> "Attributes":
        if (self.stick_density is None) == (self.stick_mass is None):
            has = "none is" if self.stick_mass is None else "both are"
            raise ValueError(f"one of {' and '.join(STICK_WEIGHT)} must be given; {has} given")
        return self


class TableMap(Given):
    """Map from a table's columns to a recording.

    Attributes:
        delimiter: Between two cells; None follows the rule of `table`.
        decimal: In a number; None likewise.
        skip: Lines before the header.
        rate_hz: Rows per second, in place of the column `time` [Hz].
        columns: Of the recording's variables.
        attributes: Sizes and densities.
        yaw_deg: By which x and y are turned, counterclockwise seen from above, to lie in the
            cameras' planes [deg].
        source: Where the data come from.
    """

    delimiter: Annotated[str, Field(min_length=1, max_length=1)] | None = None
    decimal: Literal[".", ","] | None = None
    skip: Annotated[int, Field(ge=0)] = 0
    rate_hz: Positive | None = None
    columns: Columns = Columns()
    attributes: Attributes
    yaw_deg: Annotated[float, Field(ge=-360.0, le=360.0, allow_inf_nan=False)] = 0.0
    source: str = "imported"

    @property
    def read_columns(self) -> list[tuple[str, Column[Any]]]:
        """Field and column of all that is read."""
        return [one for one in self.columns.by_field() if self.rate_hz is None or one[0] != "time"]

    def values(self, table: Table) -> dict[str, NDArray[np.float64]]:
        """Variables of a recording by name, in SI units, of shape (rows,)."""
        values: dict[str, NDArray[np.float64]] = {}
        if self.rate_hz is not None:
            values["time"] = np.arange(len(table.lines)) / self.rate_hz
        for name, column in self.read_columns:
            values[name] = values.get(name, 0.0) + column.read(table)
        return values

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
    return read_toml(path, TableMap, fix=MAP_FIX)


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
    out = new_file(out, Argument("out"), suffix=".nc")
    where, cure = Argument("columns"), "a TOML file, or what open_table_map returns"
    meaning = opened(columns, TableMap, open_table_map, where, "map of columns", cure)
    columns_read = [column.column for _, column in meaning.read_columns]
    signs = {"delimiter": meaning.delimiter, "decimal": meaning.decimal, "skip": meaning.skip}
    read = read_table(table, columns_read, **signs)
    read.require(columns_read, HEADER_FIX)
    dataset, told = _dataset(read, meaning)
    check_values(as_recording(dataset, read.path, b""), MAP_HINT)
    _check_target(out)
    write_netcdf(dataset, out)
    if told:
        logger.info("%s: %s", read.path, told)
    if unused := read.others(columns_read):
        logger.info("%s: columns not used: %s", read.path, ", ".join(unused))
    return read_recording(out)


def _check_target(out: Path) -> None:
    """Refuse to write over anything but an earlier import."""
    from xarray import open_dataset

    if not out.exists():
        return
    try:
        with open_dataset(out, engine="h5netcdf", decode_times=False) as dataset:
            imported = "imported_from" in dataset.attrs
    except (OSError, ValueError):
        imported = False
    if not imported:
        raise InputError("exists already, and is no import", where=str(out), fix=OTHER_NAME)


def _stamps(table: Table, name: str) -> NDArray[np.float64]:
    """Times of a column of ISO 8601 texts since 1970 [s], shape (rows,)."""
    times = np.empty(len(table.lines))
    for at, cell in enumerate(table.column(name)):
        try:
            time = datetime.fromisoformat(cell)
        except ValueError:
            raise InputError(
                f"{cell!r:.40} is no date and time",
                where=table.where(table.lines[at], name),
                fix=f"write it by ISO 8601, such as {ISO}, or give seconds",
            ) from None
        times[at] = (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()
    return times


def _dataset(table: Table, meaning: TableMap) -> "tuple[Dataset, str]":
    """The recording, and what was done to its rows; "" if nothing was."""
    values, told = at_camera_times(one_row_per_stamp(meaning.values(table)))
    made = {
        "Conventions": "CF-1.11",
        "source": meaning.source,
        "imported_from": table.path.name,
        "imported_sha256": hashlib.sha256(table.path.read_bytes()).hexdigest(),
        "imported_with": f"bolfi-liquids {version('bolfi-liquids')}: {meaning.model_dump_json()}",
    }
    if told:
        made["history"] = told
    return recording_dataset(meaning.turned(values), meaning.attributes.in_si() | made), told


def one_row_per_stamp(values: dict[str, NDArray]) -> dict[str, NDArray]:
    """Rows of two logs that share a stamp as one row, where no variable is given twice.

    Args:
        values: By field of a recording, of equal shape (rows,); NaN where a cell is empty.

    Returns:
        Likewise; the same values where stamps differ, or where two rows contradict each other.
    """
    from pandas import DataFrame

    rows = DataFrame(values).groupby("time")
    if not (np.diff(values["time"]) >= 0.0).all() or (rows.count() > 1).any(axis=None):
        return values
    merged = rows.first().reset_index()  # of each variable what is not missing
    return {name: merged[name].to_numpy() for name in values}


def at_camera_times(values: dict[str, NDArray]) -> tuple[dict[str, NDArray], str]:
    """A robot's rows with a camera's slower ones between them, as rows of the camera alone.

    Two logs that are merged by their times have empty cells wherever one of them has no row. The
    gripper moves a few millimetres between two rows of its own, and is interpolated linearly; an
    inclination never is. A log is merged so if less than half of its rows hold an inclination, and
    these follow each other at another rate than all rows.

    Args:
        values: By field of a recording, of equal shape (rows,); NaN where a cell is empty.

    Returns:
        The values, and what was done; the same values and "" where the rows are of one kind.
    """
    time = values["time"]
    seen = np.isfinite(values[PLANES[0]]) | np.isfinite(values[PLANES[1]])
    step, seen_step = np.diff(time), np.diff(time[seen])
    if not len(seen_step) or seen.mean() >= MIN_SEEN or not (step > 0.0).all():
        return values, ""
    if np.median(seen_step) < SLOWER * np.median(step):
        return values, ""
    if clock_difference(time, *(np.stack([values[n] for n in of], -1) for of in (AXES, PLANES))):
        return values, ""
    kept = {name: one[seen] for name, one in values.items()}
    for axis in AXES:
        known = np.isfinite(values[axis])
        own = time[known]
        if len(own):
            filled = np.interp(kept["time"], own, values[axis][known], np.nan, np.nan)
            after = np.clip(np.searchsorted(own, kept["time"]), 1, max(len(own) - 1, 1))
            far = np.diff(own, append=np.inf)[after - 1] > MAX_GRIPPER_GAP
            kept[axis] = np.where(far & np.isnan(kept[axis]), np.nan, filled)
    told = (
        f"{', '.join(AXES)} were interpolated to the {seen.sum()} of {len(time)} times at which "
        f"{' or '.join(PLANES)} is given"
    )
    return kept, told


def outline(recording: Recording) -> str:
    """Outline of a recording in a few lines that show a wrong unit or sign at a glance."""
    path = recording.gripper.position
    reach, fastest = np.nanmax(path, axis=0) - np.nanmin(path, axis=0), np.nanmax(speed(recording))
    lines = [
        f"{recording.path}: {1.0 / np.median(np.diff(recording.time)):.1f} Hz",
        *(f"{subject}: {told}" for subject, told in recording.subjects().items()),
        f"gripper: {100 * reach[0]:.1f} x {100 * reach[1]:.1f} cm, "
        f"{100 * np.nanmean(path[:, 2]):.1f} cm above the cup's floor, "
        f"up to {100 * fastest:.1f} cm/s",
    ]
    lines += [
        f"{name}: {np.nanmin(angle):+.1f} to {np.nanmax(angle):+.1f} deg, "
        f"seen in {np.isfinite(angle).mean():.1%} of the samples"
        for name, angle in zip(PLANES, np.degrees(recording.inclination.T), strict=True)
    ]
    return "\n".join([*lines, *(f"warning: {one}" for one in _warnings(recording))])


def _warnings(recording: Recording) -> Iterator[str]:
    """Warnings and refusals of `calibrate`."""
    yield from recording.torn
    yield from frame_faults(recording)
    try:
        check_start(recording)
    except InputError as err:
        yield str(err)
