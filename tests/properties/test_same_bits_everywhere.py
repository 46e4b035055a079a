"""Where simulations run changes no bit of a calibration or of a pour."""

import numpy as np
import pytest
import xarray as xr
from distributed import LocalCluster

import bolfi_liquids as bl
from bolfi_liquids.cli.compute import open_executor_of
from bolfi_liquids.inputs.bundled import bundled_recording

STIR = {"budget": 9, "batch": 3, "particles": 100, "chains": 2, "draws": 50, "seed": 5}
POUR = {"iterations": 7, "draws": 4, "seed": 2}
GROUPS = ("posterior", "simulations", "posterior_predictive", "replicates", "closest")


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster on this computer; its scheduler's address."""
    with LocalCluster(
        n_workers=2, threads_per_worker=1, protocol="tcp://", dashboard_address=None
    ) as made:
        yield made.scheduler_address


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A second and a half: the pause, and the beginning of the first stroke."""
    path = tmp_path_factory.mktemp("recordings") / "short.nc"
    with xr.open_dataset(bundled_recording("glycerin").path, decode_times=False) as whole:
        whole.isel(time=slice(0, 45)).to_netcdf(path)
    return path


def concluded(recording, out, workers, dask):
    """A calibration and a pour, made as `--workers` and `--dask` say."""
    with open_executor_of(workers, dask) as executor:
        where = {"executor": executor, "timeout": 60.0, "progress": False}
        calibration = bl.calibrate(recording, out=out, **STIR, **where)
        return calibration, bl.choose_pour(calibration, **POUR, **where)


@pytest.fixture(scope="module")
def alone(recording, tmp_path_factory):
    """In this process."""
    return concluded(recording, tmp_path_factory.mktemp("alone") / "run", 1, None)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.EmulatorWarning")
@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.SamplingWarning")
@pytest.mark.parametrize("where", ["processes", "dask"])
def test_workers_and_clusters_conclude_the_same(alone, recording, cluster, tmp_path, where):
    workers, dask = (2, None) if where == "processes" else (1, cluster)
    calibration, pour = concluded(recording, tmp_path / "run", workers, dask)
    here, poured_here = alone
    for group in GROUPS:
        for name, values in here.tree[group].data_vars.items():
            if name != "seconds":
                there = calibration.tree[group][name].to_numpy()
                np.testing.assert_array_equal(there, values.to_numpy(), err_msg=f"{group}/{name}")
    for name in ("chosen", "plug_in"):
        judged, judged_here = getattr(pour, name), getattr(poured_here, name)
        assert judged.action == judged_here.action
        np.testing.assert_array_equal(judged.fractions, judged_here.fractions)
