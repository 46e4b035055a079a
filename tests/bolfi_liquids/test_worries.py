"""What a report warns of."""

import numpy as np
import pytest
import xarray as xr

from bolfi_liquids.calibration_figures import _rms_by
from bolfi_liquids.pour_figure import as_good
from bolfi_liquids.worries import worries

FINE = {
    "fit_rms_deg": 0.3,
    "noise_deg": 0.3,
    "below_least_viscosity": 0.0,
    "rhat_max": 1.0,
    "ess_min": 2000.0,
    "divergences": 0,
    "n_draws": 4000,
}
AGREES = {"verdict": "none", "baseline": 2}
POURED = {"expected_spillage": 0.01}


def poured(rate=1.0, distance=0.03):
    actions = xr.Dataset(
        coords={"angular_velocity": [0.5, 1.0, 3.0], "distance": [0.0, 0.03, 0.07]}
    )
    chosen = xr.Dataset(attrs={"angular_velocity": rate, "distance": distance})
    return xr.DataTree.from_dict({"/actions": actions, "/chosen": chosen})


def test_nothing_is_said_where_nothing_is_wrong():
    assert worries(FINE, AGREES, POURED, poured()) == []


@pytest.mark.parametrize(
    ("calibrated", "criticised", "spilled", "action", "told"),
    [
        ({"rhat_max": 1.2}, AGREES, 0.01, {}, "did not converge"),
        ({"below_least_viscosity": 0.5, "least_viscosity": 0.03}, AGREES, 0.01, {}, "look alike"),
        ({}, None, 0.01, {}, "was not criticised: whether"),
        ({"fit_rms_deg": 0.9}, None, 0.01, {}, "farther from the recording than noise"),
        ({}, {**AGREES, "baseline": 0}, 0.01, {}, "Without clean recordings"),
        ({}, AGREES, 0.12, {}, "expected to spill 12 %"),
        ({}, AGREES, 0.01, {"rate": 0.5}, "is the slowest that"),
        ({}, AGREES, 0.01, {"rate": 3.0, "distance": 0.07}, "is the fastest and the farthest"),
    ],
)
def test_each_worry_is_said_alone(calibrated, criticised, spilled, action, told):
    section = {"expected_spillage": spilled}
    (sentence,) = worries({**FINE, **calibrated}, criticised, section, poured(**action))
    assert told in sentence


def test_a_run_without_a_pour_says_so():
    assert worries(FINE, AGREES, None, None) == ["No pour was chosen yet."]


def test_actions_are_alike_only_as_far_as_paired_draws_tell(rng):
    liquids = rng.uniform(0.0, 0.5, size=(16, 1, 1))  # what all actions spill of a liquid alike
    worse = np.array([[0.0, 0.001, 0.1]])
    noise = rng.normal(0.0, 0.02, size=(16, 1, 3))
    spilled = liquids + worse + noise
    assert as_good(spilled, (0.25 + worse)).tolist() == [[True, True, False]]


def test_the_residual_of_a_stroke_is_its_own():
    numbers = np.repeat([0, 1, 4], 5)
    values = np.where(numbers == 1, 3.0, 0.0)
    values[2] = np.nan
    assert _rms_by(numbers, values).tolist() == [0.0, 3.0, 0.0]
