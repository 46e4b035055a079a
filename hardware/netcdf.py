"""The bytes of a netCDF file, made in memory."""

import sys
from contextlib import nullcontext
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
