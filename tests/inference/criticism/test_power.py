"""Which sizes of an effect would be found, and which could hide, in a linear problem."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.power import LIMIT, POWER
from bolfi_liquids.inference.criticism.verdict import CREDIBLE, NONE, probabilities
from scipy.stats import norm

from bolfi_liquids import inference
from tests.inference.criticism.test_verdict import FITS, candidate

N, SD, WIDE = 64, 0.1, 2.0
TIME = np.linspace(-1.0, 1.0, N)
PRIOR = inference.Prior({"level": dist.Uniform(-1.0, 1.0)})
EXTENSIONS = {
    "slope": criticism.Extension(dist.Normal(0.0, WIDE)),
    "bend": criticism.Extension(dist.HalfNormal(WIDE)),
    "echo": criticism.Extension(dist.Normal(0.0, 1e-3)),
}
SHAPES = {"slope": TIME, "bend": TIME**2, "echo": np.cos(9.0 * TIME)}


def linear(theta, seeds):
    effects = [theta[name][:, None] * shape for name, shape in SHAPES.items() if name in theta]
    return theta["level"][:, None] + sum(effects) * np.ones(N)


@pytest.fixture(scope="module")
def found():
    observed = 0.1 + SD * np.random.default_rng(3).normal(size=N)
    data = criticism.Experiment(linear, observed, criticism.KnownNoise(SD))
    return criticism.criticise(data, PRIOR, EXTENSIONS, batch=64)


def visible(name):
    """Length of the effect's unit change beside the level, in noise sds."""
    return float(np.linalg.norm(SHAPES[name] - SHAPES[name].mean())) / SD


def test_the_smallest_size_is_found_with_its_power(found):
    """Its log likelihood, half the square of a normal about its signal-to-noise ratio, makes "none"
    incredible: more seldom for a tenth less, more often for a tenth more."""
    size, single = found.sensitivities["slope"].smallest, found.base.singles["slope"]

    def share(of):
        z = of * size * visible("slope") + np.random.default_rng(0).normal(size=4000)
        made = [candidate("slope", gain=0.5 * one**2, occam=single.occam) for one in z]
        none = [probabilities(FITS, [one], len(EXTENSIONS))[NONE] for one in made]
        return np.mean(np.array(none) < 1.0 - CREDIBLE)

    assert share(0.9) < POWER < share(1.1)


def test_what_could_hide_is_the_end_of_the_exact_interval(found):
    sd = 1.0 / visible("slope")
    shape = TIME / np.sum(TIME**2)
    estimate = shape @ found.experiment.observed
    exact = abs(estimate) + norm.ppf(LIMIT) * sd
    assert found.sensitivities["slope"].limit == pytest.approx(exact, rel=0.1)


def test_an_effect_that_the_prior_allows_no_visible_size_is_never_found(found):
    echo = found.sensitivities["echo"]
    assert np.isnan(echo.smallest) and echo.limit < 5e-3


def test_effects_that_look_alike_cannot_be_isolated(found):
    """A slope and a bend are orthogonal: nothing of either is absorbed by the other."""
    names = list(found.base.signatures)
    row = dict(zip(names, found.isolability[names.index("slope")], strict=True))
    assert row["slope"] == pytest.approx(0.0, abs=1e-3 * row["bend"])
    snr = found.base.signatures["slope"].snr
    assert row["bend"] == pytest.approx(snr, rel=0.05)
