"""Recordings are read from their files and checked."""

import io
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..files import existing_file
from .checks import check_values
from .recording import REQUIRED, STICK_WEIGHT, UNITS, Recording, as_recording
from .start import check_start
from .toml_file import opened

if TYPE_CHECKING:
    from xarray import Dataset

HDF5, CLASSIC_NETCDF = b"\x89HDF\r\n\x1a\n", b"CDF"  # how such files begin
DAMAGE = (
    OSError,
    ValueError,
    RuntimeError,
    LookupError,
    AttributeError,
    TypeError,
    ArithmeticError,
    MemoryError,
)
"""What the libraries that read NetCDF raise where bytes of a file are wrong."""

SPELLINGS = {
    "s": ("s", "sec", "second", "seconds"),
    "m": ("m", "metre", "metres", "meter", "meters"),
    "rad": ("rad", "radian", "radians"),
}
"""Of each unit, as files have them."""

Source = Recording | str | Path


def open_recording(path: str | Path) -> Recording:
    """Read a recording and check that it can be simulated: from rest, as a simulation starts.

    Args:
        path: A NetCDF file with the fields, units and attributes that
            `bolfi-liquids guide recordings` lists.

    Raises:
        InputError: The file is missing, is no NetCDF file, or holds something a simulator
            cannot use; the message names file, field, value and what to do.
    """
    recording = read_recording(path)
    check_recording(recording)
    return recording


def check_recording(recording: Recording) -> None:
    """Raise `InputError` unless a recording can be simulated; see `open_recording`."""
    check_values(recording)
    check_start(recording)


def read_recording(path: str | Path) -> Recording:
    """Read a recording whose values nobody needs to check.

    Raises:
        InputError: The file is missing or damaged, or lacks a field.
    """
    content = existing_file(path).read_bytes()
    return as_recording(read_fields(content, Path(path)), Path(path), content)


def open_recordings(
    sources: Source | Iterable[Source], option: str = "recordings"
) -> list[Recording]:
    """One or several, those that are opened already as they are.

    Args:
        sources: Recordings or their paths.
        option: What they were given as, for a refusal.

    Raises:
        InputError: One of them cannot be used.
    """
    if isinstance(sources, Source) or not isinstance(sources, Iterable):
        sources = [sources]
    cure = "paths of NetCDF files, or what open_recording returns"
    return [opened(one, Recording, open_recording, option, "recording", cure) for one in sources]


def read_fields(content: bytes, path: Path) -> "Dataset":
    """All variables and attributes of a recording's file, from its bytes.

    Raises:
        InputError: The file is damaged, or lacks a field.
    """
    if not content.startswith((HDF5, CLASSIC_NETCDF)):
        raise InputError(
            "not a NetCDF file that can be read",
            where=str(path),
            fix="if it is a table, bolfi-liquids import makes a recording of it",
        )
    import h5py
    import xarray

    try:
        if content.startswith(HDF5):  # where its root is damaged, h5netcdf complains twice
            with h5py.File(io.BytesIO(content), "r") as file:
                list(file.attrs.items())
        # times stay numbers: a unit such as "ms" is then seen, not silently converted
        dataset = xarray.load_dataset(io.BytesIO(content), decode_times=False)
    except DAMAGE as err:
        raise InputError("damaged, cannot be read", where=str(path), fix="copy it again") from err
    for field, what, fix in _field_faults(dataset):
        raise InputError(what, where=f"{path}: {field}", fix=fix)
    return dataset


def _field_faults(dataset: "Dataset") -> Iterator[tuple[str, str, str]]:
    """Field, fault and remedy of what is not there, or not in SI units."""
    held = ", ".join(sorted(map(str, dataset.variables))) or "no variables"
    if missing := [name for name in UNITS if name not in dataset.variables]:
        needed = f"a recording needs {', '.join(UNITS)}"
        yield ", ".join(missing), f"missing (the file holds {held})", needed
    for name, si in UNITS.items():
        variable = dataset[name]
        unit = str(variable.attrs.get("units", si))
        if variable.dims != ("time",):
            yield name, f"has dimensions {variable.dims}", "it must have the dimension time"
        elif " since " in unit:
            since = f"store the time since the first sample in {si}, as float64"
            yield name, f"holds dates, {variable.dtype} in {unit!r}", since
        elif variable.dtype.kind != "f":  # complex and whole numbers have lost a part
            what = f"holds {variable.dtype} in {unit!r}, not decimal numbers"
            yield name, what, f"store it in {si}, as float64"
        elif unit not in SPELLINGS[si]:
            yield name, f"has units {unit!r}", f"convert it to {si} and set units to {si!r}"
    missing = [name for name in REQUIRED if name not in dataset.attrs]
    if not any(name in dataset.attrs for name in STICK_WEIGHT):
        missing.append(" or ".join(STICK_WEIGHT))
    if missing:
        yield f"attribute {', '.join(missing)}", "missing", "add it to the file, in SI units"
