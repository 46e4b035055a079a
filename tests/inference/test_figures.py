"""Figures and representations of a fit show what it holds."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bolfi_liquids import inference


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
    """The observed line lies inside a 90 % band in most samples, and the closest run is near."""
    (ax,) = fit.plot_predictive()
    middle, closest, seen = (line.get_ydata() for line in ax.lines)
    np.testing.assert_array_equal(seen, observed)
    np.testing.assert_array_equal(closest, fit.closest.signal)
    assert np.abs(middle - observed).max() < 0.3  # the noise has an sd of 0.05
    assert len(ax.collections) == 1


def test_a_surrogate_of_the_discrepancy_draws_no_band(line_fit):
    (ax,) = line_fit.plot_predictive(line_fit.sample("quadrature", draws=8))
    assert len(ax.lines) == 2 and not ax.collections


def test_too_few_axes_are_refused(fit):
    with pytest.raises(ValueError, match="1 channels, got 0"):
        fit.plot_predictive(axes=[])


def test_objects_tell_what_they_hold(fit, prior, observed):
    engine = inference.Bolfi(prior, observed)
    engine.ask(3)
    with inference.SimulationBank() as bank:
        bank.put("mine", {"a": 1.0}, 0, inference.simulations.Simulation(None, "<b>", 0.0))
        shown = [(fit, "9"), (engine, "3 asked"), (bank, "1 simulations, 1 failed")]
        for value, part in shown:
            assert part in repr(value) and "<table>" in value._repr_html_()
            assert type(value).__name__ in repr(value)
    assert "closed" in repr(bank)
