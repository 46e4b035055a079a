"""Files that are written whole or not at all, netCDF among them."""

import errno
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from xarray import Dataset, DataTree


def netcdf_content(data: "Dataset | DataTree") -> bytes:
    """Bytes of a netCDF file of `data`, such that xarray reads it back with h5netcdf.

    In memory, since HDF5 crashes at the process's end after a write that the disk refused.
    """
    # with a Dask client about, xarray would lock by its scheduler, which knows named files only
    dask = sys.modules.get("dask")
    with dask.config.set(scheduler="synchronous") if dask else nullcontext():
        return bytes(data.to_netcdf(engine="h5netcdf"))


def write_whole(path: Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file beside `path`, then move it into place.

    A reader, or a crash in between, sees the old file or the new one and never a part.

    Returns:
        `path`.
    """
    temporary = None
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        os.close(handle)
        temporary = Path(name)
        write(temporary)
        temporary.chmod(0o644)  # mkstemp's own mode hides results from a group
        temporary.replace(path)
    except OSError as err:
        if (why := disk_errno(err)) is None:
            raise
        raise OSError(why, os.strerror(why), str(path)) from err
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
    return path


_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)


def disk_errno(err: BaseException) -> int | None:
    """The number of the disk's refusal to write that an error tells of; None if of none."""
    number = getattr(err, "errno", None)
    return number if number in _OF_THE_DISK else None


def write_netcdf(data: "Dataset | DataTree", path: Path) -> Path:
    """Write data by `write_whole`, such that xarray reads them back with h5netcdf."""
    content = netcdf_content(data)
    return write_whole(path, lambda temporary: temporary.write_bytes(content))
