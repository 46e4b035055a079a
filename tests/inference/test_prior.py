"""Prior quantiles and densities against SciPy, and the way there and back."""

import pickle
import subprocess
import sys

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.gp.process import (
    BOTH_TAILS,
    LOWER_TAIL,
    NO_TAIL,
    UPPER_TAIL,
    coordinates,
)
from numpyro.distributions.transforms import ExpTransform
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


@pytest.mark.slow
def test_a_process_that_gets_a_prior_can_send_it_back(mixed):
    back = "import pickle, sys; pickle.dump(pickle.load(sys.stdin.buffer), sys.stdout.buffer)"
    sent = pickle.dumps(mixed)
    done = subprocess.run([sys.executable, "-c", back], input=sent, capture_output=True)
    again = pickle.loads(done.stdout)
    u = np.random.default_rng(0).uniform(size=(50, 3))
    for name, values in mixed.from_unit(u).items():
        np.testing.assert_array_equal(again.from_unit(u)[name], values)


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


REFERENCES = [
    (dist.Uniform(2.0, 3.0), stats.uniform(2.0, 1.0)),
    (dist.LogUniform(1e-3, 20.0), stats.loguniform(1e-3, 20.0)),
    (dist.Normal(2.0, 3.0), stats.norm(2.0, 3.0)),
    (dist.Gamma(2.0, 3.0), stats.gamma(2.0, scale=1 / 3.0)),
    (dist.Gamma(0.5, 3.0), stats.gamma(0.5, scale=1 / 3.0)),
    (dist.InverseGamma(2.0, 3.0), stats.invgamma(2.0, scale=3.0)),
    (dist.Beta(2.0, 5.0), stats.beta(2.0, 5.0)),
    (dist.Cauchy(1.0, 2.0), stats.cauchy(1.0, 2.0)),
    (dist.Laplace(1.0, 2.0), stats.laplace(1.0, 2.0)),
    (dist.Logistic(1.0, 2.0), stats.logistic(1.0, 2.0)),
    (dist.StudentT(3.0, 1.0, 2.0), stats.t(3.0, 1.0, 2.0)),
    (dist.Weibull(2.0, 1.5), stats.weibull_min(1.5, scale=2.0)),
    (dist.Chi2(3.0), stats.chi2(3.0)),
    (dist.LogNormal(0.5, 1.2), stats.lognorm(1.2, scale=np.exp(0.5))),
    (dist.HalfNormal(2.0), stats.halfnorm(scale=2.0)),
    (dist.Exponential(2.0), stats.expon(scale=0.5)),
    (dist.TruncatedNormal(0.0, 1.0, low=-1.0, high=2.0), stats.truncnorm(-1.0, 2.0)),
    (dist.TruncatedNormal(0.0, 1.0, low=7.0, high=8.0), stats.truncnorm(7.0, 8.0)),
    (dist.TruncatedNormal(0.0, 1.0, high=-8.0), stats.truncnorm(-np.inf, -8.0)),
]


def test_distributions_agree_with_scipy_and_their_ends_are_finite():
    u = np.array([0.0, 1e-6, 0.1, 0.5, 0.9, 1.0 - 1e-6, 1.0])[:, None]
    for distribution, reference in REFERENCES:
        prior = inference.Prior({"a": distribution})
        near = {"rtol": 2e-5, "err_msg": str(prior)}
        theta = prior.from_unit(u)
        np.testing.assert_allclose(theta["a"][2:5], reference.ppf(u[2:5, 0]), **near)
        np.testing.assert_allclose(prior.to_unit(theta)[2:5], u[2:5], **near)
        density = prior.log_prob(theta)
        np.testing.assert_allclose(density[1:6], reference.logpdf(theta["a"][1:6]), atol=1e-4)
        # at quantiles 0 and 1 too: a surface over the prior must not end in infinities
        assert np.isfinite(theta["a"]).all() and np.isfinite(density).all(), prior


EDGES = np.array([1e-6, 1e-3, 0.1, 0.5, 0.9, 1.0 - 1e-3, 1.0 - 1e-6])[:, None]


@pytest.mark.parametrize(
    "distribution",
    [
        dist.LogUniform(1e-9, 1e3),
        dist.Cauchy(1.0, 2.0),
        dist.Gumbel(1.0, 2.0),  # by numpyro's own functions
        dist.TruncatedNormal(0.0, 1.0, low=8.0),
        dist.TruncatedNormal(5.0, 2.0, low=30.0, high=31.0),
        dist.TruncatedNormal(0.0, 1.0, low=-30.0, high=-29.0),
        dist.TruncatedCauchy(0.0, 1.0, low=50.0),
        pytest.param(  # JAX compiles for seconds
            dist.TransformedDistribution(dist.Normal(0.0, 1.0), ExpTransform()),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_quantiles_return_from_both_tails(distribution):
    prior = inference.Prior({"a": distribution})
    theta = prior.from_unit(EDGES)
    np.testing.assert_allclose(prior.to_unit(theta), EDGES, atol=1e-9)
    assert (np.diff(theta["a"]) > 0.0).all() and np.isfinite(prior.log_prob(theta)).all()


def test_outside_the_support_the_density_vanishes():
    prior = inference.Prior({"a": dist.LogNormal(0.0, 1.0), "b": dist.Gamma(2.0, 1.0)})
    theta = {"a": [0.0, -1.0, 1.0], "b": [1.0, 1.0, 0.0]}
    np.testing.assert_array_equal(prior.log_prob(theta), -np.inf)


def test_units_and_descriptions_are_kept():
    prior = inference.Prior(
        {
            "viscosity": dist.LogUniform(0.003, 20),
            "tilt": dist.TruncatedNormal(0.0, 0.1, low=-0.5, high=0.5),
            "share": dist.Beta(2.0, 2.0),
        },
        units={"viscosity": "Pa s", "tilt": "rad"},
    )
    assert prior.units == {"viscosity": "Pa s", "tilt": "rad"}
    described = prior.describe()
    assert described["viscosity"] == {"prior": "LogUniform(low=0.003, high=20)", "units": "Pa s"}
    assert described["tilt"]["prior"] == "TruncatedNormal(loc=0, scale=0.1, low=-0.5, high=0.5)"
    assert described["share"] == {"prior": "Beta(concentration1=2, concentration0=2)"}


def test_at_which_ends_priors_fade_out():
    """They, or their logs; what ends abruptly does not."""
    prior = inference.Prior(
        {
            "box": dist.Uniform(-1.0, 2.0),
            "decades": dist.LogUniform(1e-3, 20.0),
            "bell": dist.Normal(3.0, 2.0),
            "log_bell": dist.LogNormal(0.0, 2.0),
            "rate": dist.Gamma(2.0, 1.0),
            "arcsine": dist.Beta(0.5, 0.5),
            "middle": dist.TruncatedNormal(0.0, 1.0, low=-0.5, high=0.5),
            "half": dist.HalfNormal(0.3),
            "wait": dist.Exponential(2.0),
            "below": dist.TruncatedNormal(1.0, 0.5, high=1.0),
        }
    )
    ends = [NO_TAIL, NO_TAIL, BOTH_TAILS, BOTH_TAILS, UPPER_TAIL, NO_TAIL, NO_TAIL]
    assert prior.tails.tolist() == [*ends, UPPER_TAIL, UPPER_TAIL, LOWER_TAIL]


@pytest.mark.parametrize("kind", [NO_TAIL, BOTH_TAILS, UPPER_TAIL, LOWER_TAIL])
def test_scores_have_the_mean_and_sd_of_quantiles(kind):
    u = (np.arange(100_000) + 0.5) / 100_000
    at = coordinates(u[:, None], np.array([kind]))[:, 0]
    assert (np.diff(at) > 0.0).all()
    assert at.mean() == pytest.approx(0.5, abs=1e-3)
    assert at.std() == pytest.approx(12.0**-0.5, rel=1e-3)
    # a prior of half a normal is linear in them
    if kind == UPPER_TAIL:
        value = stats.halfnorm.ppf(u)
        assert np.corrcoef(value, at)[0, 1] > 1.0 - 1e-9


def test_names_of_the_results_columns_are_reserved(prior, observed, simulate):
    fit = inference.fit(simulate, prior, observed, budget=8)
    for name in set(fit.simulations) - set(prior.names):
        with pytest.raises(ValueError, match="reserved"):
            inference.Prior({name: dist.Normal(0.0, 1.0)})


@pytest.mark.parametrize("name", ["", "a/b", "a\nb", "a\0b", "\ud800"])
def test_a_name_that_no_file_or_page_can_hold_is_refused(name):
    with pytest.raises(ValueError, match="name must be printable text"):
        inference.Prior({name: dist.Uniform(0.0, 1.0)})
