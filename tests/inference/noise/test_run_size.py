"""Run-to-run noise whose size depends on parameters or means: posteriors against exact grids."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.warnings import WIDE_RANGE

from bolfi_liquids import inference

PRIOR = inference.Prior({"q": dist.Uniform(0.1, 10)})
GRID = np.linspace(0.1, 10.0, 5001)


def noisy(mean, sd, n):
    """A simulator of n numbers, of mean and sd as functions of q."""

    def simulate(theta, seeds):
        drawn = [np.random.default_rng(seed).normal(size=n) for seed in seeds]
        return np.stack([mean(q) + sd(q) * z for q, z in zip(theta["q"], drawn, strict=True)])

    return simulate


def exact(observed, mean, sd):
    """Mean and sd of the posterior on the grid."""
    at, size = mean(GRID)[:, None], sd(GRID)[:, None]
    log_density = np.sum(-np.log(size) - 0.5 * ((observed - at) / size) ** 2, 1)
    weight = np.exp(log_density - log_density.max())
    weight /= weight.sum()
    centre = weight @ GRID
    return centre, np.sqrt(weight @ (GRID - centre) ** 2)


def drawn(simulate, observed, **options):
    fit = inference.fit(
        simulate, PRIOR, observed, budget=40, noise=0, progress=False, warn=False, **options
    )
    return fit, fit.sample("quadrature", warn=False)["posterior"]["q"].values


@pytest.mark.parametrize(
    ("mean", "n", "truth"), [(lambda q: q, 10, 0.6), (lambda q: 0.0 * q, 40, 3.0)]
)
def test_a_spread_that_grows_with_the_parameter(mean, n, truth):
    def sd(q):
        return 0.3 * q if n == 10 else q

    observed = mean(truth) + sd(truth) * np.random.default_rng(5).normal(size=n)
    centre, width = exact(observed, mean, sd)
    simulate = noisy(mean, sd, n)
    fit, draws = drawn(simulate, observed)
    assert abs(draws.mean() - centre) < width
    assert 0.7 < draws.std() / width < 1.5
    # taken as constant, it is as wide as that of most runs
    assert drawn(simulate, observed, varying_noise=False)[1].std() > 2.0 * width


def test_a_constant_spread_changes_no_bit():
    simulate = noisy(lambda q: q, lambda q: 1.0, 10)
    observed = 3.0 + np.random.default_rng(1).normal(size=10)
    found = [drawn(simulate, observed, varying_noise=varying)[1] for varying in (True, False)]
    np.testing.assert_array_equal(*found)


def test_counts_of_a_random_simulator_are_emulated_as_roots():
    shape = np.linspace(1.0, 8.0, 20)

    def simulate(theta, seeds):
        runs = zip(theta["q"], seeds, strict=True)
        return np.stack([np.random.default_rng(s).poisson(q * shape) * 1.0 for q, s in runs])

    observed = np.random.default_rng(3).poisson(4.0 * shape) * 1.0
    fit, draws = drawn(simulate, observed)
    assert fit.learned.scale.stretch.power == 1
    log_density = observed.sum() * np.log(GRID) - GRID * shape.sum()
    weight = np.exp(log_density - log_density.max())
    weight /= weight.sum()
    centre = weight @ GRID
    width = np.sqrt(weight @ (GRID - centre) ** 2)
    assert abs(draws.mean() - centre) < 0.7 * width
    assert 0.7 < draws.std() / width < 1.4
    mean = fit.surrogate.predict({"q": np.array([4.0])})[0]
    np.testing.assert_allclose(mean[0], 4.0 * shape, atol=2.0)


def peak(theta, seeds):
    return np.exp(-0.5 * ((theta["q"][:, None] - np.linspace(4, 6, 5)) / 0.02) ** 2)


def test_a_simulator_that_makes_no_noise_is_not_called_noisy():
    fit, _ = drawn(peak, peak({"q": np.array([5.0])}, None)[0])
    assert not any("run-to-run noise makes up" in one for one in fit.warnings)


def test_data_over_decades_need_a_noise():
    observed = 10.0 ** np.linspace(6, 1, 20)

    def simulate(theta, seeds):
        return observed * theta["q"][:, None]

    how = {"budget": 10, "progress": False, "warn": False}
    assert WIDE_RANGE in inference.fit(simulate, PRIOR, observed, **how).warnings
    assert WIDE_RANGE not in inference.fit(simulate, PRIOR, observed, noise=0.1, **how).warnings
