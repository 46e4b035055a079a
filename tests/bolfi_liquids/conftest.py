from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import bolfi_liquids as bl

BUNDLED = Path(str(files("bolfi_liquids.data"))) / "glycerin_v10.nc"
SHORT = 60  # samples, 2 s: the pause and the first strokes
SETTINGS = {"budget": 8, "batch": 2, "particles": 200, "seed": 3}


@pytest.fixture
def dataset():
    """The bundled recording, to be altered."""
    return xr.load_dataset(BUNDLED, decode_times=False)


@pytest.fixture(scope="session")
def short_recording(tmp_path_factory):
    """The path of a recording that simulates in a fraction of a second."""
    path = tmp_path_factory.mktemp("recordings") / "short.nc"
    whole = xr.load_dataset(BUNDLED, decode_times=False)
    whole.isel(time=slice(0, SHORT)).to_netcdf(path)
    return path


@pytest.fixture(scope="session")
def settings():
    """Of `calibration`, under the names of the command line's options."""
    return SETTINGS


@pytest.fixture(scope="session")
def calibration(short_recording, tmp_path_factory):
    """A real calibration, as small as the engine allows it to be useful."""
    out = tmp_path_factory.mktemp("runs") / "calibrated"
    return bl.calibrate(short_recording, out=out, progress=False, **SETTINGS)


@pytest.fixture(scope="session")
def pour(calibration):
    """A real pour, chosen over the calibration."""
    return bl.choose_pour(calibration, iterations=7, draws=4, progress=False)


@pytest.fixture
def rng():
    return np.random.default_rng(0)
