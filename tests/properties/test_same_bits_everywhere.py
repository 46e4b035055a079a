"""Where simulations run changes no bit of a calibration or of a pour."""

import shutil
from contextlib import contextmanager

import numpy as np
import pytest
import xarray as xr
from distributed import LocalCluster

import bolfi_liquids as bl
from bolfi_liquids.cli.options import ComputeOptions
from bolfi_liquids.inputs.bundled import bundled_recording

SETTINGS = {"budget": 9, "batch": 3, "particles": 1000, "chains": 2, "draws": 50, "seed": 5}
GROUPS = ("posterior", "simulations", "posterior_predictive", "replicates", "closest")


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster on this computer; its scheduler's address."""
    with LocalCluster(
        n_workers=2, threads_per_worker=1, protocol="tcp://", dashboard_address=":0"
    ) as made:
        yield made.scheduler_address


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A second and a half: the pause, and the beginning of the first stroke."""
    path = tmp_path_factory.mktemp("recordings") / "short.nc"
    with xr.open_dataset(bundled_recording("glycerin").path, decode_times=False) as whole:
        whole.isel(time=slice(0, 45)).to_netcdf(path)
    return path


@contextmanager
def executor_of(where, address):
    workers, dask = {"here": (1, None), "processes": (2, None), "dask": (1, address)}[where]
    with ComputeOptions(workers, dask, timeout=300.0).arguments() as where:
        yield {**where, "progress": False}


@pytest.fixture(scope="module")
def here(recording, tmp_path_factory):
    """A calibration in this process."""
    with executor_of("here", None) as where:
        return bl.calibrate(
            recording, out=tmp_path_factory.mktemp("here") / "run", **SETTINGS, **where
        )


@pytest.mark.slow
@pytest.mark.parametrize("where", ["processes", pytest.param("dask", marks=pytest.mark.minutes)])
def test_a_calibration_is_the_same(here, recording, cluster, tmp_path, where):
    with executor_of(where, cluster) as options:
        there = bl.calibrate(recording, out=tmp_path / "run", **SETTINGS, **options)
    for group in GROUPS:
        for name, values in here.tree[group].data_vars.items():
            if name != "seconds":
                found = there.tree[group][name].to_numpy()
                np.testing.assert_array_equal(found, values.to_numpy(), err_msg=f"{group}/{name}")


@pytest.mark.minutes
@pytest.mark.parametrize("where", ["processes", "dask"])
def test_a_pour_is_the_same(here, cluster, tmp_path, where):
    found = []
    for at in ("here", where):
        run = tmp_path / at
        shutil.copytree(here.path, run)
        with executor_of(at, cluster) as options:
            found.append(bl.choose_pour(run, budget=24, draws=16, seed=2, force=True, **options))
    for judged, other in zip(*((one.chosen, one.plug_in) for one in found), strict=True):
        assert judged.action == other.action
        np.testing.assert_array_equal(judged.fractions, other.fractions)
