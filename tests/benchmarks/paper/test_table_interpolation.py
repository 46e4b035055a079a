"""What a table of pours says between its actions, and how far that may be off."""

from types import SimpleNamespace

import numpy as np
import pytest

from .table_interpolation import between

RATES = np.geomspace(0.5, 3.0, 5)


def table(spilled):
    """Pours on a grid of actions, of which a function tells the spillage."""
    rate, distance = (m.ravel() for m in np.meshgrid(RATES, np.linspace(0, 0.06, 7)))
    values = spilled(np.log(rate), distance)
    fractions = np.column_stack([values, 1.0 - values, 0.0 * values])
    return SimpleNamespace(angular_velocity=rate, distance=distance, fractions=fractions)


def test_a_linear_table_is_interpolated_without_error():
    plane = table(lambda log_rate, distance: 0.3 + 0.1 * log_rate + 2.0 * distance)
    value, error = between(plane, 1.2, 0.033)
    assert value == pytest.approx(0.3 + 0.1 * np.log(1.2) + 2.0 * 0.033)
    assert error == pytest.approx(0.0, abs=1e-12)


def test_a_table_curved_in_the_distance_tells_its_error():
    def curved(_, distance):
        return 200.0 * (distance - 0.03) ** 2

    for rate in (1.2, RATES[2]):
        value, error = between(table(curved), rate, 0.025)
        assert abs(value - curved(0, 0.025)) < 3.0 * error < 0.1


def test_a_table_curved_in_the_angular_velocity_tells_its_error_between_its_rows():
    def curved(log_rate, _):
        return 0.1 * log_rate**2

    between_rows = np.sqrt(RATES[2] * RATES[3])
    value, error = between(table(curved), between_rows, 0.025)
    step = np.log(RATES[1] / RATES[0])
    # of a chord over twice the step, by its second derivative: 0.2 / 2 * step^2
    assert error == pytest.approx(0.1 * step**2)
    assert abs(value - curved(np.log(between_rows), 0)) < error
    assert between(table(curved), RATES[2], 0.025)[1] == pytest.approx(0.0, abs=1e-12)


def test_beyond_the_table_its_edge_is_taken_and_no_error_is_claimed():
    rising = table(lambda log_rate, distance: 10.0 * distance)
    for rate, distance, edge in (1.0, 0.08, 0.6), (0.4, 0.03, 0.3), (3.5, 0.03, 0.3):
        value, error = between(rising, rate, distance)
        assert value == pytest.approx(edge)
        assert np.isnan(error)
    assert np.isfinite(between(rising, RATES[-1], 0.06)[1])
