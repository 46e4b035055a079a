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
