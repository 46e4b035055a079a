"""Data of a world that is not the simulated one: nothing passes for a posterior to be relied upon.

The stirs and pours are of an SPH code, see tests/data/wrong_simulator.
"""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.stats import chi2

import bolfi_liquids as bl
from bolfi_liquids.criticism.pours import Fractions, PourNoise
from bolfi_liquids.inputs.bundled import bundled_pours
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.pour_table import open_pours
from bolfi_liquids.reporting.warnings import Results, warnings_of
from bolfi_liquids.simulators import PourSimulator

WRONG = Path(__file__).parents[1] / "data" / "wrong_simulator"
SETTINGS = {"budget": 12, "batch": 4, "chains": 2, "draws": 200, "sampler": "emcee"}
SAMPLES = 120  # 4 s, five strokes
TRUTHS = {"water": 0.001, "oil": 0.1, "glycerin": 1.0}  # Pa s
BAD_FIT, MISFIT = "fit is bad", "more than noise"  # words of warnings
GLYCERIN = {"viscosity": np.array([1.0]), "cohesion": np.array([0.063 / 0.08])}
GLYCERIN_DENSITY = 1260.0  # kg/m3
HOLD = 2.1  # s, of the reference's glycerin
LEVEL = 1e-3


@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.surrogates.warnings.EmulatorWarning")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("liquid", "warned"),
    [
        ("water", BAD_FIT),
        ("oil", BAD_FIT),
        ("glycerin", MISFIT),
    ],
)
def test_a_posterior_that_misses_the_truth_comes_with_a_warning(liquid, warned, tmp_path):
    whole = xr.load_dataset(WRONG / f"{liquid}_v10.nc", decode_times=False)
    whole.isel(time=slice(0, SAMPLES)).to_netcdf(tmp_path / "stir.nc")
    calibration = bl.calibrate(
        tmp_path / "stir.nc", out=tmp_path / "run", progress=False, **SETTINGS
    )
    viscosity = calibration.summary.parameters["viscosity"]
    assert not viscosity.q05 <= TRUTHS[liquid] <= viscosity.q95
    warnings = warnings_of(Results.of(calibration.run))
    assert any(warned in warning for warning in warnings)
    if warned == BAD_FIT:
        assert BAD_FIT in warnings[0]
        with pytest.raises(bl.InputError):
            bl.choose_pour(calibration, progress=False)


def p_value(table, hold):
    """Of a table of glycerin's pours at its true parameters, the simulator's usual error counted.

    The difference of one simulation, as a normal variable of `PourNoise`.
    """
    cups = bundled_cups()
    cups = cups.model_copy(update={"pour": cups.pour.model_copy(update={"hold": hold})})
    actions = Fractions(table.angular_velocity, table.distance)
    pouring = PourSimulator(cups, GLYCERIN_DENSITY, actions)
    missed = (table.observed - pouring.simulate(GLYCERIN, np.array([1]))[0]).ravel()
    pours = len(table.distance)
    at = SimpleNamespace(channel=np.tile(np.arange(pours), 2), sample=np.repeat([0, 1], pours))
    noise = PourNoise(table.angular_velocity, table.distance).covariance(at)
    return chi2.sf(missed @ np.linalg.solve(noise, missed), missed.size)


@pytest.mark.slow
def test_pours_of_a_wrong_simulator_differ_by_more_than_this_one_errs():
    """Those of the reference do not: the same test does not reject whatever it is given."""
    wrong = open_pours(WRONG / "pours.csv", "glycerin")
    assert p_value(wrong, bundled_cups().pour.hold) < LEVEL
    assert p_value(bundled_pours("glycerin"), HOLD) > LEVEL
