"""Which sizes of an effect would be found, and which could hide, in a linear problem."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.power import LIMIT, POWER
from scipy.stats import binom

from bolfi_liquids import inference

N, SD, WIDE = 64, 0.1, 2.0
TIME = np.linspace(-1.0, 1.0, N)
PRIOR = inference.Prior({"level": dist.Uniform(-1.0, 1.0)})
EXTENSIONS = {
    "slope": criticism.Extension(dist.Normal(0.0, WIDE)),
    "bend": criticism.Extension(dist.HalfNormal(WIDE)),
    "echo": criticism.Extension(dist.Normal(0.0, 1e-3)),
    "twin": criticism.Extension(dist.Normal(0.0, 0.5)),
}
SHAPES = {"slope": TIME, "bend": TIME**2, "echo": np.cos(9.0 * TIME), "twin": -3.0 * TIME}


def linear(theta, seeds):
    effects = [theta[name][:, None] * shape for name, shape in SHAPES.items() if name in theta]
    return theta["level"][:, None] + sum(effects) * np.ones(N)


def criticised(slope, seed):
    observed = 0.1 + slope * TIME + SD * np.random.default_rng(seed).normal(size=N)
    data = criticism.Experiment(linear, observed, criticism.KnownNoise(SD))
    return criticism.criticise(data, PRIOR, EXTENSIONS, batch=64)


@pytest.fixture(scope="module")
def found():
    return criticised(0.0, 3)


def visible(name):
    """Length of the effect's unit change beside the level, in noise sds."""
    return float(np.linalg.norm(SHAPES[name] - SHAPES[name].mean())) / SD


@pytest.mark.slow
def test_the_smallest_size_is_found_with_its_power(found):
    """In 20 data sets, within what a binomial count leaves in all but one of ten thousand cases."""
    size, sets = found.sensitivities["slope"].smallest, 20
    verdicts = [criticised(size, seed).verdict.kind for seed in range(10, 10 + sets)]
    count = sum(one != "none" for one in verdicts)
    low, high = binom.ppf([5e-5, 1.0 - 5e-5], sets, POWER)
    assert low <= count <= high


def test_what_could_hide_is_the_quantile_of_the_exact_posterior(found):
    """Of the distance from neutral, under a normal posterior of known mean and sd."""
    sd = 1.0 / visible("slope")
    estimate = TIME / np.sum(TIME**2) @ found.experiment.observed
    draws = np.abs(estimate + sd * np.random.default_rng(0).normal(size=100_000))
    exact = np.quantile(draws, LIMIT)
    assert found.sensitivities["slope"].limit == pytest.approx(exact, rel=0.1)


def test_an_effect_that_the_prior_allows_no_visible_size_is_never_found(found):
    echo = found.sensitivities["echo"]
    assert np.isnan(echo.smallest)
    assert echo.limit == pytest.approx(1.96e-3, rel=0.02)  # the prior's own


def test_what_another_effect_absorbs_cannot_be_isolated(found):
    """A slope and a bend are orthogonal; a twin of the slope absorbs all of it."""
    names = list(found.base.signatures)
    row = dict(zip(names, found.isolability[names.index("slope")], strict=True))
    snr = found.base.signatures["slope"].snr
    assert row["bend"] == pytest.approx(snr, rel=0.05)
    assert row["twin"] < 0.1 * snr
