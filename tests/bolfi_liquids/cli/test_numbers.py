"""Noise estimates, picked draws and contour levels, against what is known of them."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from bolfi_liquids.calibration.figures import contour_levels, marginal
from bolfi_liquids.calibration.result import pick_draws
from bolfi_liquids.calibration.stirs import irreducible_rms, replicate_noise, sensor_noise
from bolfi_liquids.calibration.summary import CalibrationSummary, bad_fit
from bolfi_liquids.cli.printed import print_warnings
from bolfi_liquids.pouring.spillage import mean_spillage, tail_spillage
from bolfi_liquids.reporting.facts import fit_facts
from bolfi_liquids.reporting.warnings import Results, warnings_of
from bolfi_liquids.run.run import Run


def test_sensor_noise_is_found_under_a_smooth_signal(rng):
    time = np.arange(0.0, 200.0, 1 / 30)
    smooth = np.stack([7.0 * np.sin(4.0 * time), 5.0 * np.cos(3.0 * time)], axis=-1)
    noise = 0.1 * rng.normal(size=smooth.shape)
    noise[100:110] = np.nan
    # relative standard error of the estimate: below 2 %; five of them
    assert sensor_noise(smooth + noise) == pytest.approx(0.1, rel=0.1)
    assert sensor_noise(smooth) < 0.01


def test_replicate_noise_is_the_rms_between_two_seeds(rng):
    replicates = 0.3 * rng.normal(size=(40, 500))
    pairs = [np.sqrt(np.mean((a - b) ** 2)) for a, b in zip(replicates, replicates[1:])]  # noqa: B905  one fewer pair
    assert replicate_noise(replicates) == pytest.approx(np.mean(pairs), rel=0.02)


def test_both_noises_add_in_quadrature(rng):
    observed = 0.4 * rng.normal(size=(4000, 2))
    replicates = 0.3 / np.sqrt(2.0) * rng.normal(size=(50, 4000, 2))
    assert irreducible_rms([observed], replicates) == pytest.approx(0.5, rel=0.05)


def test_picked_draws_are_stratified_and_stay_together(rng):
    first = rng.lognormal(size=(4, 250))
    posterior = xr.Dataset(
        {"viscosity": (("chain", "draw"), first), "cohesion": (("chain", "draw"), -first)}
    )
    picked = pick_draws(posterior, 10, seed=0)
    np.testing.assert_array_equal(picked["cohesion"], -picked["viscosity"])
    deciles = np.searchsorted(np.quantile(first, np.arange(0.1, 1.0, 0.1)), picked["viscosity"])
    np.testing.assert_array_equal(deciles, np.arange(10))
    assert not np.array_equal(picked["viscosity"], pick_draws(posterior, 10, 1)["viscosity"])
    with pytest.raises(ValueError, match="1 to 1000, got 1001"):
        pick_draws(posterior, 1001, seed=0)


def test_picked_means_are_unbiased(rng):
    posterior = xr.Dataset({"viscosity": (("chain", "draw"), rng.lognormal(size=(2, 101)))})
    means = [pick_draws(posterior, 10, seed)["viscosity"].mean() for seed in range(400)]
    error = np.std(means) / np.sqrt(len(means))
    # strata differ by one draw in twenty, hence the second term
    assert abs(np.mean(means) - float(posterior["viscosity"].mean())) < 4 * error + 0.05


def test_contours_hold_their_probability():
    x = np.linspace(-6.0, 6.0, 241)
    density = np.exp(-0.5 * (x[:, None] ** 2 + x[None, :] ** 2))
    levels = contour_levels(density, density)
    # in two dimensions a share p of a normal lies above exp(-r^2 / 2) = 1 - p
    np.testing.assert_allclose(levels, [0.1, 0.5], rtol=0.02)


def test_marginal_of_a_normal_has_unit_area():
    x, y = np.linspace(-6.0, 6.0, 241), np.geomspace(0.1, 9.0, 101)
    density = 3.0 * np.exp(-0.5 * x[:, None] ** 2) * np.sqrt(y)[None, :]
    np.testing.assert_allclose(
        marginal(density, x, y), np.exp(-0.5 * x**2) / np.sqrt(2 * np.pi), rtol=1e-6
    )


def test_the_terminal_warns_of_what_the_report_warns_of(
    calibration, tmp_path, capsys, with_numbers
):
    run = shutil.copytree(calibration.path, tmp_path / "run")
    far = {"fit_rms_deg": 2.0, "noise_deg": 0.5, "below_least_viscosity": 0.42}
    with_numbers(run, **far)
    results = Results.of(Run.open(run))
    print_warnings(results)
    told = capsys.readouterr().out.splitlines()
    assert told == [f"warning: {warning}" for warning in warnings_of(results)]
    assert any("42 % of the posterior" in line for line in told)
    assert told[0] == f"warning: {bad_fit(replace(calibration.summary, **far))}"


@pytest.mark.parametrize(
    ("viscosity", "rms", "noise", "status"),
    [
        (1.0, 0.59, 0.2, "acceptable"),
        (1.0, 0.61, 0.2, "bad"),
        (1.0, 0.25, 0.01, "acceptable"),  # no camera measures so well: the search has not ended
        (1.0, 0.2, np.nan, "bad"),
        (1e-3, 0.55, 0.1, "acceptable"),  # the simulator errs by as much in water
        (np.nan, 0.2, 0.1, "bad"),
    ],
)
def test_a_fit_is_bad_from_three_times_the_noise_on(calibration, viscosity, rms, noise, status):
    closest = {"viscosity": viscosity, "cohesion": 0.5}
    summary = replace(calibration.summary, closest=closest, fit_rms_deg=rms, noise_deg=noise)
    assert summary.fit_status == status
    assert (bad_fit(summary) is None) == (status == "acceptable")
    section = summary.to_json()
    assert section["fit_status"] == status
    ratio = summary.fit_to_noise
    assert section["fit_to_noise"] == (None if np.isnan(ratio) else pytest.approx(ratio))
    again = CalibrationSummary.from_json(section)
    assert again.fit_status == status


def test_a_wrong_frame_is_bad_however_near_the_fit(calibration):
    near = replace(calibration.summary, fit_rms_deg=0.2, noise_deg=0.2)
    turned = replace(near, frame_faults=("stir.nc: turned by 45 deg",))
    assert (near.fit_status, turned.fit_status) == ("acceptable", "bad")
    found = bad_fit(turned)
    assert found is not None and "stir.nc: turned by 45 deg" in str(found)
    again = CalibrationSummary.from_json(turned.to_json())
    assert again.frame_faults == turned.frame_faults


def test_a_sampler_that_did_not_converge_is_told(calibration):
    numbers = {"rhat_max": 1.003, "ess_min": 900.0, "divergences": 3, "n_draws": 4000}
    good = replace(calibration.summary, **numbers)
    assert good.sampler_status == "converged" and fit_facts(good)["converged"]
    for worse in ({"rhat_max": 1.2}, {"rhat_max": np.nan}, {"ess_min": 40.0}, {"divergences": 90}):
        summary = replace(good, **worse)
        assert summary.sampler_status == "not converged" and summary.sampler_status.advice
        assert not fit_facts(summary)["converged"]


def test_risks_of_known_outcomes():
    spilled = np.linspace(0.0, 0.95, 20)[:, None] * [1.0, 0.5]
    assert mean_spillage(spilled) == pytest.approx([0.475, 0.2375])
    assert tail_spillage(spilled) == pytest.approx([0.925, 0.4625])
