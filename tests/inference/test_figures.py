"""Figures and representations of a fit show what it holds."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from bolfi_liquids.inference.simulations.failures import raised

from bolfi_liquids import inference

pytestmark = pytest.mark.slow


@pytest.fixture
def fit(simulate, prior, observed):
    return inference.fit(simulate, prior, observed, budget=9, warn=False, progress=False, noise=0.0)


def test_the_search_is_drawn_round_by_round(fit):
    ax = plt.subplots()[1]
    assert fit.plot_search(ax) is ax
    points, least = (line.get_xydata() for line in ax.lines[:2])
    np.testing.assert_array_equal(points[:, 1], fit.history.discrepancy)
    np.testing.assert_array_equal(points[:, 0], fit.history.rounds + 1)
    assert least[-1, 1] == fit.closest.discrepancy and (np.diff(least[:, 1]) <= 0).all()


def test_what_was_observed_is_drawn_with_its_prediction(fit, observed):
    """A 90 % band holds the 30 samples; less than 20 of them with a chance of 5e-4."""
    (ax,) = fit.plot_predictive()
    (band,) = ax.collections
    corners = band.get_paths()[0].vertices
    low, high = (
        np.array([end(corners[corners[:, 0] == index, 1]) for index in range(len(observed))])
        for end in (np.min, np.max)
    )
    assert np.sum((low <= observed) & (observed <= high)) >= 20
    assert np.all(high - low < 10 * 0.05)  # the noise has an sd of 0.05
    middle, closest, seen = (line.get_ydata() for line in ax.lines)
    np.testing.assert_array_equal(seen, observed)
    np.testing.assert_array_equal(closest, fit.closest.signal)
    assert np.all((low <= middle) & (middle <= high))


def test_a_surrogate_of_the_discrepancy_draws_no_band(line_fit):
    (ax,) = line_fit.plot_predictive(line_fit.sample("quadrature", draws=8))
    assert len(ax.lines) == 2 and not ax.collections


def test_too_few_axes_are_refused(fit):
    with pytest.raises(ValueError, match="1 channels, got 0"):
        fit.plot_predictive(axes=[])
    with pytest.raises(ValueError, match="must be what `sample` returned or None, got 3"):
        fit.plot_predictive(3)


def test_objects_tell_what_they_hold(fit, prior, observed):
    engine = inference.Bolfi(prior, observed)
    engine.ask(3)
    with inference.SimulationBank() as bank:
        failed = inference.simulations.Simulation(None, raised(OSError("<b>")), 0.0)
        bank.put("mine", {"a": 1.0}, 0, failed)
        shown = [(fit, "9"), (engine, "3 asked"), (bank, "1 simulations, 1 failed")]
        for value, part in shown:
            assert part in repr(value) and "<table>" in value._repr_html_()
            assert type(value).__name__ in repr(value)
    assert "closed" in repr(bank)


def test_a_surrogate_shows_its_prior_and_no_address(fit, prior):
    shown = repr(fit.surrogate)
    assert "0x" not in shown and all(name in shown for name in prior.names)


def test_fits_are_compared_without_an_error(fit):
    """By what they are: their arrays say no single yes or no."""
    other = replace(fit, seconds={})
    assert fit == fit and fit != other
    assert fit.surrogate.learned != replace(fit.learned)
