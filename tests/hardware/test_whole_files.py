"""The bytes of a netCDF file, made in memory."""

import io

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.hardware.whole_files import netcdf_content
from distributed import LocalCluster

DATA = xr.Dataset({"angle": ("time", np.linspace(0.0, 1.0, 7))}, {"time": np.arange(7.0)})


def read(content):
    with xr.open_dataset(io.BytesIO(content), engine="h5netcdf") as found:
        return found.load()


def test_what_is_written_is_read_back():
    xr.testing.assert_identical(read(netcdf_content(DATA)), DATA)


@pytest.mark.slow
def test_a_dask_client_of_the_process_does_not_matter():
    with (
        LocalCluster(n_workers=0, protocol="tcp://", dashboard_address=":0") as cluster,
        cluster.get_client(),
    ):
        xr.testing.assert_identical(read(netcdf_content(DATA)), DATA)
