"""The intervals of a calibration allow for an error of the simulator, usual or learned."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.inference.surrogates.measurement_noise import Layout
from bolfi_liquids.models import stirring_error

import bolfi_liquids as bl
from bolfi_liquids.calibration import calibrate as calibrating
from bolfi_liquids.calibration import check as checking
from bolfi_liquids.calibration.check import check_by_simulation
from bolfi_liquids.calibration.model_error import SHORT_PART, model_error
from bolfi_liquids.calibration.stir_simulator import stirring_of
from bolfi_liquids.reporting.sentences import model_error_sentence
from bolfi_liquids.run.simulations import Kept


@pytest.fixture
def stirring(short_recording):
    return stirring_of([bl.open_recording(short_recording)], 200)


@pytest.mark.parametrize("viscosity", [0.001, 0.1, 1.0])
def test_the_usual_error_has_its_size_and_the_correlation_of_the_recording(stirring, viscosity):
    error = model_error(stirring, viscosity)
    assert error.rms == pytest.approx(np.hypot(1.0, SHORT_PART) * stirring_error(viscosity))
    assert error.clean == ()
    samples = len(stirring.observed)
    at = Layout(np.zeros(samples, int), np.arange(samples))
    covariance = error.usual.covariance(at)
    assert np.linalg.eigvalsh(covariance)[0] > 0.0
    # seconds at rest, so the neighbours of most samples are like them
    assert covariance[0, 1] > 0.5 * covariance[0, 0]


def test_a_calibration_says_for_which_error_it_allows(calibration):
    summary = calibration.summary
    usual = np.degrees([stirring_error(v) for v in (0.001, 0.05, 0.1, 1.0)])
    assert np.isclose(summary.model_error_deg, np.hypot(1.0, SHORT_PART) * usual).any()
    said = str(model_error_sentence(summary))
    assert f"{summary.model_error_deg:.2f}° RMS" in said and "usual" in said
    learned = str(model_error_sentence(replace(summary, clean=("a.nc", "b.nc"))))
    assert "learned from a.nc, b.nc" in learned
    without = str(model_error_sentence(replace(summary, model_error_deg=0.0)))
    assert "do not allow" in without and "--surrogate signal" in without


@pytest.mark.slow
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


@pytest.fixture
def _unsimulated(monkeypatch):
    monkeypatch.setattr(calibrating, "_calibrate", lambda *_: pytest.fail("simulated"))


def rerated(dataset):
    return dataset.isel(time=slice(None, None, 2))


def widened(dataset):
    return dataset.assign_attrs(cup_radius=1.1 * dataset.attrs["cup_radius"])


def hasty(dataset):
    return dataset.isel(time=slice(10, None))


def same(dataset):
    return dataset.isel(time=slice(0, 60))


@pytest.mark.parametrize(
    ("change", "surrogate", "fault"),
    [
        (rerated, "signal", "samples a second"),
        (widened, "signal", "cup_radius"),
        (hasty, "signal", "before the gripper moves"),
        (same, "signal", "what is calibrated on"),
        (lambda dataset: dataset, "discrepancy", "does not allow for an error"),
    ],
)
@pytest.mark.usefixtures("_unsimulated")
def test_clean_recordings_that_say_nothing_are_refused_before_the_first_simulation(
    change, surrogate, fault, dataset, short_recording, tmp_path
):
    clean = tmp_path / "clean.nc"
    change(dataset).to_netcdf(clean)
    with pytest.raises(bl.InputError, match=fault):
        bl.calibrate(
            short_recording,
            out=tmp_path / "run",
            baseline=clean,
            surrogate=surrogate,
            progress=False,
        )
    assert not (tmp_path / "run").exists()


def test_the_closest_run_at_posterior_draws_judges_a_fit(monkeypatch):
    """Failed runs are left out; parameters stay with their signals."""
    observed = np.zeros((5, 2))
    signals = np.array([3.0, 0.5, 2.0])[:, None, None] * np.ones((3, 5, 2))
    kept = iter([Kept(signals, np.array([0, 2, 3]), 1.0), Kept(signals, np.arange(3), 2.0)])
    monkeypatch.setattr(checking, "simulate_kept", lambda *_, **__: next(kept))
    stirring = SimpleNamespace(
        observed=observed,
        simulate=None,
        discrepancy=lambda: lambda a, b: float(np.sum((a - b) ** 2)),
    )
    draws = {"viscosity": np.array([1.0, 2.0, 3.0, 4.0])}
    found = check_by_simulation(stirring, draws, {"viscosity": 2.5}, 0, None)
    assert found.closest.theta == {"viscosity": 3.0}
    np.testing.assert_array_equal(found.closest.signal, signals[1])
    assert found.closest.discrepancy == pytest.approx(2.5)
    assert found.seconds == 3.0
