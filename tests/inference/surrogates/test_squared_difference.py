import numpy as np
import pytest
from scipy.integrate import trapezoid

from bolfi_liquids import inference


def test_agrees_with_scipy_on_an_irregular_grid_with_missing_samples():
    rng = np.random.default_rng(1)
    time = np.sort(rng.uniform(0.0, 7.0, 40))
    observed, simulated = rng.normal(size=(2, 40, 2))
    observed[[0, 5, 6, 39], 0] = np.nan
    observed[20, 1] = np.nan
    expected = 0.0
    for channel in range(2):
        seen = np.isfinite(observed[:, channel])
        residual = (observed - simulated)[seen, channel]
        expected += trapezoid(residual**2, time[seen])
    distance = inference.squared_difference(time)
    np.testing.assert_allclose(distance(observed, simulated), expected, rtol=1e-12)


def test_unit_steps_without_time_and_what_counts():
    """A simulated NaN counts only where something was observed."""
    distance = inference.squared_difference()
    assert distance(np.zeros(3), np.array([1.0, 2.0, 3.0])) == 9.0
    observed, simulated = np.array([1.0, np.nan, 1.0]), np.array([1.0, np.nan, 1.0])
    assert distance(observed, simulated) == 0.0
    assert np.isnan(distance(np.ones(3), simulated))


@pytest.mark.parametrize(
    ("time", "observed", "simulated", "named"),
    [
        ([0.0, 0.0, 1.0], np.zeros(3), np.zeros(3), "time"),
        ([0.0, 1.0], np.zeros(3), np.zeros(3), "time"),
        (None, np.zeros(3), np.zeros(4), "signal"),
        (None, np.array([1.0, np.nan]), np.zeros(2), "observed"),
    ],
)
def test_bad_input_is_refused(time, observed, simulated, named):
    with pytest.raises(ValueError, match=named):
        inference.squared_difference(time)(observed, simulated)
