"""What a report warns of."""

import numpy as np
import pytest
import xarray as xr

from bolfi_liquids.reporting.calibration_figures import _rms_by
from bolfi_liquids.reporting.pour_figure import not_surely_worse
from bolfi_liquids.reporting.warnings import worries

FINE = {
    "fit_rms_deg": 0.3,
    "noise_deg": 0.3,
    "below_least_viscosity": 0.0,
    "rhat_max": 1.0,
    "ess_min": 2000.0,
    "divergences": 0,
    "n_draws": 4000,
    "n_simulations": 20,
}
AGREES = {"verdict": "none", "baseline": 2}
POURED = {"expected_spillage": 0.01}


def poured(rate=1.0, distance=0.03, retained=0.05):
    actions = xr.Dataset(
        coords={"angular_velocity": [0.5, 1.0, 3.0], "distance": [0.0, 0.03, 0.07]}
    )
    chosen = xr.Dataset(
        {"retained": ("outcome", [0.0, 2.0 * retained])},
        attrs={"angular_velocity": rate, "distance": distance},
    )
    liquids = xr.Dataset({"viscosity": ("draw", [1.0, 3.0])})
    return xr.DataTree.from_dict({"/actions": actions, "/chosen": chosen, "/liquids": liquids})


POSTERIOR = xr.Dataset({"viscosity": (("chain", "draw"), [[1.0, 2.0, 3.0]])})


def test_nothing_is_said_where_nothing_is_wrong():
    assert worries(FINE, AGREES, POURED, poured(), POSTERIOR, 13) == []


@pytest.mark.parametrize(
    ("calibrated", "criticised", "spilled", "action", "told"),
    [
        ({"rhat_max": 1.2}, AGREES, 0.01, {}, "did not converge"),
        ({"below_least_viscosity": 0.5, "least_viscosity": 0.03}, AGREES, 0.01, {}, "look alike"),
        ({"emulator_warnings": ["too few runs"]}, AGREES, 0.01, {}, "in doubt: too few runs."),
        ({}, None, 0.01, {}, "was not criticised: whether"),
        ({"fit_rms_deg": 0.9}, None, 0.01, {}, "farther from the recording than noise"),
        ({}, {**AGREES, "baseline": 0}, 0.01, {}, "Without clean recordings"),
        ({}, AGREES, 0.12, {}, "expected to spill 12 %"),
        ({}, AGREES, 0.01, {"rate": 0.5}, "is the slowest that"),
        ({}, AGREES, 0.01, {"retained": 0.4}, "40 % stays in the source"),
        ({}, AGREES, 0.01, {"rate": 3.0, "distance": 0.07}, "is the fastest and the farthest"),
    ],
)
def test_each_worry_is_said_alone(calibrated, criticised, spilled, action, told):
    section = {"expected_spillage": spilled}
    (sentence,) = worries(
        {**FINE, **calibrated}, criticised, section, poured(**action), POSTERIOR, 13
    )
    assert told in sentence


@pytest.mark.parametrize(
    "posterior",
    [POSTERIOR.assign(adhesion=POSTERIOR["viscosity"]), POSTERIOR + 0.5],
    ids=["extended", "other"],
)
def test_a_pour_of_another_posterior_is_said_to_be_one(posterior):
    (sentence,) = worries(FINE, AGREES, POURED, poured(), posterior, 13)
    assert "choose it again" in sentence


def test_a_search_of_no_more_than_its_start_is_none():
    (sentence,) = worries(FINE, AGREES, POURED, poured(), POSTERIOR, 1)
    assert "Of 20 simulations only 1" in sentence


def test_a_run_without_a_pour_has_nothing_to_worry_about_in_it():
    assert worries(FINE, AGREES, None, None, POSTERIOR, 13) == []


def test_an_action_is_surely_worse_only_as_far_as_paired_draws_tell(rng):
    liquids = rng.uniform(0.0, 0.5, size=(16, 1, 1))  # what all actions spill of a liquid alike
    spilled = np.repeat(liquids, 3, axis=2)
    spilled[..., 1] += np.tile([[-0.02], [0.022]], (8, 1))  # more by 0.001 on average, se 0.005
    spilled[..., 2] += 0.1
    assert not_surely_worse(spilled, "mean", (0, 0)).tolist() == [[True, True, False]]


def test_what_is_compared_is_the_risk_that_was_minimised():
    spilled = np.zeros((20, 1, 2))
    spilled[:, 0, 0] = 0.02  # little of every liquid
    spilled[:4, 0, 1] = 0.1  # nothing of most, as much on average, and more of the worst tenth
    assert not_surely_worse(spilled, "mean", (0, 0)).tolist() == [[True, True]]
    assert not_surely_worse(spilled, "cvar", (0, 0)).tolist() == [[True, False]]


def test_few_draws_tell_nothing():
    assert not not_surely_worse(np.zeros((3, 1, 2)), "mean", (0, 0)).any()


def test_the_residual_of_a_stroke_is_its_own():
    numbers = np.repeat([0, 1, 4], 5)
    values = np.where(numbers == 1, 3.0, 0.0)
    values[2] = np.nan
    assert _rms_by(numbers, values).tolist() == [0.0, 3.0, 0.0]
    values[numbers == 4] = np.nan
    assert np.isnan(_rms_by(numbers, values)[2])
