import warnings

import numpy as np
import pytest
from bolfi_liquids.inference.sobol import sobol
from bolfi_liquids.inference.surrogates.discrepancy import learn, with_threshold
from bolfi_liquids.inference.surrogates.threshold import Transform, candidates

pytestmark = pytest.mark.slow


def bowl(u, rng, power):
    """A positive surface whose `power` is smooth with even noise."""
    surface = 1.0 + 3.0 * ((u - 0.4) ** 2).sum(-1) + 0.05 * rng.normal(size=len(u))
    return surface**power


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda u, rng: bowl(u, rng, 1.0), "identity"),
        (lambda u, rng: bowl(u, rng, 2.0), "sqrt"),
        (lambda u, rng: np.exp(3.0 * bowl(u, rng, 1.0)), "log"),
    ],
)
def test_the_transform_that_made_the_data_is_found(make, expected):
    u = sobol(0, 0, 40, 2)
    assert learn(u, make(u, np.random.default_rng(0))).transform.name == expected


def test_jacobian_and_inverse_are_that_of_the_transform():
    x = np.array([0.5, 2.0])
    for name in ("identity", "sqrt", "log"):
        g = Transform(name, 0.0)
        slope = (g(x + 1e-6) - g(x - 1e-6)) / 2e-6
        np.testing.assert_allclose(g.log_jacobian(x), np.log(slope), atol=1e-6)
        np.testing.assert_allclose(g.inverse(g(x)), x)


def test_a_discrepancy_of_zero_stays_finite():
    values = np.array([0.0, 0.2, 0.4, 1.0, 3.0, 2.0])
    for g in candidates(None, values):
        assert np.isfinite(g(values)).all()
        assert np.isfinite(g.log_jacobian(values)).all()
    fitted = learn(sobol(0, 0, 6, 1), values, "log")
    assert np.isfinite(fitted.threshold)


def test_negative_discrepancies_allow_the_identity_and_a_logarithm_from_below_them():
    values = np.array([-1.0, 0.2, 0.4])
    identity, log = candidates(None, values)
    assert (identity.name, log.name) == ("identity", "log") and log.offset > 1.0
    np.testing.assert_allclose(log.inverse(log(values)), values)
    with pytest.raises(ValueError, match="'log' needs discrepancies >= 0"):
        candidates("log", values)


@pytest.mark.parametrize("value", [2.0, 0.1, 1e-16])
def test_equal_discrepancies_are_learned_as_flat(value):
    """But for rounding, which is not to be learned."""
    u = np.random.default_rng(0).uniform(size=(12, 2))
    almost = value * (1.0 + 1e-15 * np.random.default_rng(1).uniform(size=12))
    found = learn(u, almost)
    mean, _ = found.predict(np.random.default_rng(2).uniform(size=(50, 2)))
    assert np.ptp(found.transform.inverse(mean)) < 1e-9 * value
    assert found.warnings() == ["all simulations are equal: the data cannot tell parameters apart"]
    other = learn(u, u.sum(1), previous=found)  # and then they are not
    assert np.ptp(other.predict(u)[0]) > 0.1


def test_a_discrepancy_outside_the_transform_changes_it():
    rng = np.random.default_rng(3)
    u = rng.uniform(size=(16, 1))
    values = np.exp(6.0 * u[:, 0] + 0.1 * rng.normal(size=16))
    found = learn(u, values)
    assert found.transform.name == "log"
    values[3] = -1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        changed = learn(u, values, previous=found).transform
    assert changed.name == "identity" or changed.offset > 1.0


def test_minimum_and_threshold_agree_with_a_grid():
    u = sobol(0, 0, 30, 2)
    values = bowl(u, np.random.default_rng(0), 1.0)
    fitted = with_threshold(learn(u, values, "identity"), "min_mean")
    axis = np.linspace(0.0, 1.0, 101)
    grid = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    mean, sd = fitted.predict(grid)
    noise = fitted.scale.spread * np.exp(float(fitted.gp.hyper.log_noise[0]))
    sure = mean + np.sqrt(sd**2 - noise**2)
    np.testing.assert_allclose(fitted.best(), grid[sure.argmin()], atol=0.011)
    assert fitted.threshold == pytest.approx(fitted.predict(u)[0].min())
    assert mean.min() < fitted.threshold < mean.min() + sd.min()


def test_the_threshold_is_not_taken_where_nothing_was_simulated():
    """The trend falls off the edge of the data, below anything that a discrepancy can be."""
    u = sobol(0, 0, 40, 2)
    u = u[u.sum(1) < 1.1]
    fitted = learn(u, 5.0 - 4.0 * u.sum(1), "identity")
    assert fitted.predict(np.ones((1, 2)))[0] < 0.0 < fitted.threshold


def test_hyperparameters_wait_until_the_data_have_grown_by_a_third():
    u = sobol(0, 0, 26, 2)
    values = bowl(u, np.random.default_rng(0), 1.0)
    first = learn(u[:20], values[:20])
    soon = learn(u[:23], values[:23], previous=first)
    later = learn(u, values, previous=first)
    assert (soon.learned_at, later.learned_at) == (20, 26)
    np.testing.assert_array_equal(soon.gp.hyper.log_length, first.gp.hyper.log_length)
    # the three that came since were learned all the same
    assert soon.predict(u[20:23])[1].mean() < first.predict(u[20:23])[1].mean()


def test_a_run_that_blew_up_does_not_drown_the_others():
    u = sobol(0, 0, 30, 2)
    values = bowl(u, np.random.default_rng(0), 1.0)
    values[np.argmax(np.abs(u - 0.4).sum(1))] = 1e100
    fitted = learn(u, values)
    assert np.abs(fitted.best() - 0.4).max() < 0.15
