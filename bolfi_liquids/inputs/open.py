"""Recordings are read from their files and checked."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..files import existing_file
from .checks import check_values
from .fields import check_fields
from .recording import Recording, as_recording

if TYPE_CHECKING:
    from xarray import Dataset

Source = Recording | str | Path


def open_recording(path: str | Path) -> Recording:
    """Read a recording and check that it can be simulated.

    Args:
        path: A NetCDF file with the fields, units and attributes that
            `bolfi-liquids guide recordings` lists.

    Raises:
        InputError: The file is missing, is no NetCDF file, or holds something a simulator
            cannot use; the message names file, field, value and what to do.
    """
    path = existing_file(path)
    recording = as_recording(_read(path), path)
    check_values(recording)
    return recording


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
        return [_opened(sources, option)]
    return [_opened(one, option) for one in sources]


def _opened(source: object, option: str) -> Recording:
    if isinstance(source, Recording):
        return source
    if isinstance(source, str | Path):
        return open_recording(source)
    raise InputError(
        f"{source!r:.80} is no recording",
        where=option,
        fix="give paths of NetCDF files, or what open_recording returns",
    )


def _read(path: Path) -> "Dataset":
    import xarray

    try:
        # times stay numbers: a unit such as "ms" is then seen, not silently converted
        dataset = xarray.load_dataset(path, decode_times=False)
    except (OSError, ValueError) as err:
        raise InputError(
            "not a NetCDF file that can be read",
            where=str(path),
            fix="if it is a table, bolfi-liquids import makes a recording of it",
        ) from err
    check_fields(dataset, path)
    return dataset
