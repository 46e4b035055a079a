import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy import stats

from bolfi_liquids import inference


@pytest.fixture
def mixed():
    return inference.Prior(
        {
            "viscosity": dist.LogUniform(1e-3, 20.0),
            "cohesion": dist.Uniform(0.0, 1.0),
            "shift": dist.Normal(2.0, 3.0),
        }
    )


def test_round_trip_between_units_and_quantiles(mixed):
    u = np.random.default_rng(0).uniform(size=(50, 3))
    np.testing.assert_allclose(mixed.to_unit(mixed.from_unit(u)), u, atol=1e-6)


def test_quantiles_agree_with_scipy(mixed):
    theta = mixed.from_unit(np.full(3, 0.3))
    np.testing.assert_allclose(theta["viscosity"], stats.loguniform(1e-3, 20.0).ppf(0.3), rtol=1e-5)
    np.testing.assert_allclose(theta["shift"], stats.norm(2.0, 3.0).ppf(0.3), rtol=1e-6)


def test_borders_are_exact_and_finite(mixed):
    low, high = mixed.from_unit(np.zeros(3)), mixed.from_unit(np.ones(3))
    assert (low["viscosity"], high["viscosity"]) == (1e-3, 20.0)
    assert (low["cohesion"], high["cohesion"]) == (0.0, 1.0)
    assert np.isfinite([low["shift"], high["shift"]]).all()


def test_log_prob_agrees_with_scipy_and_ends_at_the_support(mixed):
    theta = {"viscosity": [0.5, 21.0], "cohesion": [0.2, 0.2], "shift": [1.0, 1.0]}
    expected = stats.loguniform(1e-3, 20.0).logpdf(0.5) + stats.norm(2.0, 3.0).logpdf(1.0)
    np.testing.assert_allclose(mixed.log_prob(theta), [expected, -np.inf], rtol=1e-6)


def test_samples_follow_the_prior(mixed):
    draws = mixed.sample(jax.random.key(0), 2000)
    assert stats.kstest(draws["shift"], stats.norm(2.0, 3.0).cdf).pvalue > 1e-4
    assert stats.kstest(draws["shift"], stats.norm(2.4, 3.0).cdf).pvalue < 1e-4  # planted bias


@pytest.mark.parametrize(
    ("distributions", "message"),
    [
        ({}, "at least one parameter"),
        ({"a": 1.0}, "numpyro distribution, got float"),
        ({"a": dist.Normal(np.zeros(2), 1.0)}, r"univariate with shape \(\), got \(2,\)"),
        ({"a": dist.MultivariateNormal(np.zeros(2), np.eye(2))}, "univariate"),
        ({"seed": dist.Normal(0.0, 1.0)}, "reserved"),
    ],
)
def test_bad_distributions_are_refused(distributions, message):
    with pytest.raises(ValueError, match=message):
        inference.Prior(distributions)


@pytest.mark.parametrize(
    ("theta", "message"),
    [
        ({"viscosity": 1.0}, "must have the parameters"),
        ({"viscosity": [1.0, 2.0], "cohesion": 0.5, "shift": 0.0}, "one length"),
        ({"viscosity": np.nan, "cohesion": 0.5, "shift": 0.0}, "must be finite"),
    ],
)
def test_bad_theta_is_refused(mixed, theta, message):
    with pytest.raises(ValueError, match=message):
        mixed.to_array(theta)
