"""Files that are there to be read, and files that are written whole or not at all."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import InputError

if TYPE_CHECKING:
    from xarray import Dataset, DataTree


def existing_file(path: str | Path) -> Path:
    """`path`, which a person gave to be read.

    Raises:
        InputError: There is no such file, or it is a directory.
    """
    path = Path(path)
    if not path.is_file():
        what = "a directory, not a file" if path.is_dir() else "no such file"
        raise InputError(what, where=str(path), fix="check the path")
    return path


def new_netcdf(path: str | Path) -> Path:
    """`path`, which a person gave to be written.

    Raises:
        InputError: Its name does not end in .nc, or no such file can be made there.
    """
    path = Path(path)
    if path.suffix != ".nc":
        raise InputError(f"ends in {path.suffix!r}", where=str(path), fix="give a name in .nc")
    return new_file(path)


def new_file(path: Path) -> Path:
    """`path`, which a person gave to be written; one that is there is replaced.

    Raises:
        InputError: It is a directory, or no file can be made in its directory.
    """
    if not path.parent.is_dir():
        raise InputError("no such directory", where=str(path.parent), fix="make it first")
    if path.is_dir():
        raise InputError("is a directory", where=str(path), fix="give the name of a file")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as err:
        fix = "choose a place that can be written"
        raise InputError(f"{err.strerror}", where=str(path.parent), fix=fix) from err
    return path


def write_whole(path: Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file beside `path`, then move it into place.

    A reader, or a crash in between, sees the old file or the new one and never a part.

    Returns:
        `path`.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
        temporary.chmod(0o644)  # mkstemp's own mode hides results from a group
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def write_netcdf(data: "Dataset | DataTree", path: Path) -> Path:
    """Write data by `write_whole`, such that xarray reads them back with h5netcdf."""
    return write_whole(path, lambda temporary: data.to_netcdf(temporary, engine="h5netcdf"))


def write_text(path: Path, text: str) -> Path:
    """Write UTF-8 text by `write_whole`."""
    return write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
