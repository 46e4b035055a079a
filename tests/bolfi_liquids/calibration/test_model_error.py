"""The simulator's own error, known and learned, for which a calibration's intervals allow."""

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
from bolfi_liquids.calibration.model_error import (
    KNOWN_FREEDOM,
    SHORT_PART,
    Clean,
    model_error,
    regime_distance,
)
from bolfi_liquids.reporting.facts import fit_facts
from bolfi_liquids.reporting.prose import prose
from bolfi_liquids.simulators import StirSimulator, stir_simulator
from bolfi_liquids.wording import degrees


@pytest.fixture
def stirring(short_recording):
    return stir_simulator([bl.open_recording(short_recording)], 200)


@pytest.mark.parametrize("viscosity", [0.001, 1.0])
def test_the_known_error_has_its_size_and_the_correlation_of_the_recording(stirring, viscosity):
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


def test_the_known_error_changes_smoothly_with_the_viscosity():
    viscosities = np.geomspace(1e-4, 20.0, 400)
    sizes = [stirring_error(one) for one in viscosities]
    steps = np.diff(np.log(sizes)) / np.diff(np.log(viscosities))
    assert np.abs(steps).max() < 2.0
    assert stirring_error(0.0) == stirring_error(0.001) > 10.0 * stirring_error(1.0)
    assert np.isnan(stirring_error(np.nan))


def left(stirring, viscosity, multiple, rng):
    """A clean recording of which the simulator leaves so many times its known error."""
    (recording,) = stirring.recordings
    size = multiple * stirring_error(viscosity)
    return Clean(recording, size * rng.normal(size=recording.inclination.shape), viscosity, 1)


@pytest.mark.parametrize(
    ("viscosities", "multiple"),
    [
        ([], 1.0),
        # as many of this liquid as the known error counts for, and one far away
        ([0.4] * int(KNOWN_FREEDOM) + [0.001], np.sqrt((1.0 + 3.0**2) / 2.0)),
        ([0.001] * 9, 1.0),
    ],
)
def test_clean_recordings_show_a_multiple_of_the_known_error_where_they_are_near(
    stirring, rng, viscosities, multiple
):
    """Recorded without noise, so that all that is left is the simulator's."""
    (recording,) = stirring.recordings
    still = replace(recording, inclination=0.0 * recording.inclination)
    exact = StirSimulator((still,), stirring.setups)
    clean = [left(exact, one, 3.0, rng) for one in viscosities]
    known, learned = model_error(exact, 0.4), model_error(exact, 0.4, clean)
    ratio = learned.autocovariance[0] / known.autocovariance[0]
    assert ratio == pytest.approx(multiple**2, rel=0.3)
    # of the two, this is the mean where anything near was recorded: they differ by twice as much
    both = KNOWN_FREEDOM + sum(one == 0.4 for one in viscosities)
    z = 2.0 * (ratio - 1.0) / (ratio * np.sqrt(4.0 / KNOWN_FREEDOM))
    assert learned.freedom == pytest.approx(both / max(z**2, 1.0), rel=0.01)


def test_a_thinner_liquid_s_residual_is_that_of_a_smaller_error_here(stirring, rng):
    """Twice as thick, the simulator errs by less: both are the same multiple of what is known."""
    thin, thick = (model_error(stirring, 0.3, [left(stirring, v, 1.0, rng)]) for v in (0.15, 0.3))
    known = model_error(stirring, 0.3)
    for error in (thin, thick):
        assert error.autocovariance[0] < 1.3 * known.autocovariance[0]
    residual = left(stirring, 0.15, 1.0, rng).residual
    (one,) = model_error(stirring, 0.3, [Clean(*stirring.recordings, residual, 0.15, 1)]).clean
    ratio = stirring_error(0.3) / stirring_error(0.15)
    np.testing.assert_allclose(one.residual, ratio * residual)
    assert one.regime_distance == pytest.approx(-1.0)


def test_clean_recordings_of_the_same_path_show_where_it_errs(stirring, rng):
    clean = [left(stirring, 0.5, 10.0, rng)]
    same, elsewhere = (model_error(stirring, 0.5, clean, elsewhere=e) for e in (False, True))
    assert [one.same for one in same.clean] == [True]
    assert [one.same for one in elsewhere.clean] == [False]


def test_liquids_are_as_far_apart_as_their_viscosities():
    """In doublings; water is water, wherever below the least viscosity it was fitted."""
    for one, other, distance in ((0.1, 0.4, -2), (1.6, 0.4, 2), (3e-4, 0.001, 0), (0.01, 1e-3, 1)):
        assert regime_distance(one, other, 0.005) == pytest.approx(distance)


def test_a_calibration_says_for_which_error_it_allows(calibration):
    summary = calibration.summary
    known = np.degrees(stirring_error(summary.best["viscosity"]))
    assert summary.model_error_deg == pytest.approx(np.hypot(1.0, SHORT_PART) * known, rel=0.2)
    usual = degrees(summary.simulator_error_deg)
    for changes, words in (
        ({}, [degrees(summary.model_error_deg), f"usual one at this viscosity is {usual}"]),
        ({"model_error_deg": 0.56}, ["0.56°", f"usual one at this viscosity is {usual}"]),
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
