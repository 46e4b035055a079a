"""The intervals of a calibration allow for an error of the simulator, usual or learned."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.measurement_noise import Layout
from bolfi_liquids.models import stirring_error

import bolfi_liquids as bl
from bolfi_liquids import inference
from bolfi_liquids.calibration.engine_fit import closest_drawn
from bolfi_liquids.calibration.model_error import SHORT_PART, model_error
from bolfi_liquids.reporting.facts import fit_facts
from bolfi_liquids.reporting.prose import prose
from bolfi_liquids.simulators import stir_simulator
from bolfi_liquids.wording import degrees


@pytest.fixture
def stirring(short_recording):
    return stir_simulator([bl.open_recording(short_recording)], 200)


@pytest.mark.parametrize("viscosity", [0.001, 1.0])
def test_the_usual_error_has_its_size_and_the_correlation_of_the_recording(stirring, viscosity):
    error = model_error(stirring, viscosity)
    assert np.sqrt(error.autocovariance[0]) == pytest.approx(
        np.hypot(1.0, SHORT_PART) * stirring_error(viscosity)
    )
    samples = len(stirring.observed)
    at = Layout(np.zeros(samples, int), np.arange(samples))
    covariance = error.covariance(at)
    assert np.linalg.eigvalsh(covariance)[0] > 0.0
    # seconds at rest, so the neighbours of most samples are like them
    assert covariance[0, 1] > 0.5 * covariance[0, 0]


def test_a_calibration_says_for_which_error_it_allows(calibration):
    summary = calibration.summary
    usual = np.degrees([stirring_error(v) for v in (0.001, 0.05, 0.1, 1.0)])
    assert np.isclose(summary.model_error_deg, np.hypot(1.0, SHORT_PART) * usual).any()
    for changes, words in (
        ({}, [degrees(summary.model_error_deg), "usual"]),
        ({"clean": ("a.nc", "b.nc")}, ["learned from a.nc, b.nc"]),
        ({"model_error_deg": 0.0}, ["do not allow", "--surrogate signal"]),
    ):
        _, said = prose("fit", {"calibration": fit_facts(replace(summary, **changes))})
        assert all(word in said for word in words)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.surrogates.warnings.EmulatorWarning")
def test_the_papers_surrogate_allows_for_none(short_recording, settings, tmp_path):
    made = bl.calibrate(
        short_recording,
        out=tmp_path / "run",
        surrogate="discrepancy",
        progress=False,
        **settings,
    )
    assert made.summary.model_error_deg == 0.0
    assert made.tree.attrs["surrogate"] == "discrepancy"


def straight(theta, seeds):
    slopes = np.log(theta["viscosity"])[:, None, None]
    return slopes * np.linspace(0.2, 1.0, 10)[:, None] * np.ones(2)


def test_the_closest_run_at_posterior_draws_judges_a_fit():
    """Failed runs are left out; parameters stay with their signals."""
    prior = inference.Prior({"viscosity": dist.LogUniform(0.1, 10.0)})
    observed = straight({"viscosity": np.array([0.5])}, [0])[0]
    options = {"budget": 9, "confirm": 4, "noise": 0.1, "progress": False, "warn": False}
    fit = inference.fit(straight, prior, observed, **options)
    first, *others = fit.confirming
    discrepancy = fit.history.discrepancy.copy()
    discrepancy[first] = np.nan
    judged = replace(fit, history=fit.history._replace(discrepancy=discrepancy))
    stirring = SimpleNamespace(
        observed=observed,
        discrepancy=lambda: lambda a, b: float(np.sum((a - b) ** 2)),
    )
    found, good = closest_drawn(judged, stirring)
    nearest = min(others, key=lambda run: abs(np.log(fit.history.theta[run, 0] / 0.5)))
    assert found.theta == {"viscosity": fit.history.theta[nearest, 0]}
    np.testing.assert_array_equal(found.signal, fit.history.signals[nearest])
    assert good.tolist() == others
    assert found.discrepancy == pytest.approx(np.sum((observed - found.signal) ** 2))
