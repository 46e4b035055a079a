"""Noise that follows from the simulated mean: posteriors against exact grids."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.noise.by_mean import ByMean, Poisson, law_of, relative

from bolfi_liquids import inference

AT = np.linspace(-1.0, 1.0, 12)
COUNTS = np.random.default_rng(7).poisson(np.exp(1.2 + 1.5 * AT)).astype(float)  # from 0 to 15
PRIOR = inference.Prior({"a": dist.Uniform(-1, 3), "b": dist.Uniform(-1, 4)})
GRID = np.stack(np.meshgrid(np.linspace(-1, 3, 301), np.linspace(-1, 4, 301)), -1).reshape(-1, 2)
WIDEST, FARTHEST = (0.8, 1.25), 0.3  # ratio of sds, shift in sds


def means(theta, seeds=None):
    return np.exp(theta["a"][:, None] + theta["b"][:, None] * AT)


ON_GRID = means(dict(zip("ab", GRID.T, strict=True)))


def poisson(y, mean):
    return y * np.log(mean) - mean


def gaussian(y, mean, sd):
    return -np.log(sd) - 0.5 * ((y - mean) / sd) ** 2


def fitted(observed, noise, **options):
    return inference.fit(
        means, PRIOR, observed, budget=30, noise=noise, progress=False, warn=False, **options
    )


def compared(fit, log_density):
    """Shifts and ratios of sds [2] of the posterior, against the exact one on the grid."""
    weight = np.exp(log_density - log_density.max())
    weight /= weight.sum()
    mean = weight @ GRID
    sd = np.sqrt(weight @ (GRID - mean) ** 2)
    draws = fit.sample("quadrature", warn=False)["posterior"]
    drawn = np.stack([draws[name].values.ravel() for name in "ab"], -1)
    return (drawn.mean(0) - mean) / sd, drawn.std(0) / sd


def right(fit, log_density):
    shift, ratio = compared(fit, log_density)
    return bool((np.abs(shift) < FARTHEST).all() and (WIDEST[0] < ratio).all()) and bool(
        (ratio < WIDEST[1]).all()
    )


def test_few_counts_have_their_own_posterior():
    exact = poisson(COUNTS, ON_GRID).sum(1)
    assert right(fitted(COUNTS, "poisson"), exact)
    same = fitted(COUNTS, float(np.sqrt(COUNTS.mean())))  # one size for all: another posterior
    assert not right(same, exact)


@pytest.mark.parametrize(
    ("noise", "sd"),
    [(relative(0.2), lambda mean: 0.2 * mean), 2 * (lambda mean: 0.3 + 0.1 * np.abs(mean),)],
    ids=["in proportion", "a function"],
)
def test_noise_by_a_function_of_the_mean(noise, sd):
    clean = np.exp(1.2 + 1.5 * AT)
    observed = clean + sd(clean) * np.random.default_rng(1).normal(size=12)
    assert right(fitted(observed, noise), gaussian(observed, ON_GRID, sd(ON_GRID)).sum(1))


def test_what_is_shown_is_in_the_units_of_the_output():
    fit = fitted(COUNTS, "poisson")
    best = {name: np.array([value]) for name, value in fit.best.items()}
    mean, sd = fit.surrogate.predict(best)
    np.testing.assert_allclose(mean, means(best), rtol=0.02)
    assert (sd < 0.2 * mean).all()  # the simulator makes no noise
    tree = fit.sample("quadrature", warn=False)
    first = float(tree["constant_data"]["measurement_noise_sd"])
    assert first == pytest.approx(np.sqrt(means(best)[0, 0]), rel=0.1)
    drawn = tree["posterior_predictive"]["signal"].values.reshape(-1, 12)
    np.testing.assert_array_equal(drawn, np.round(drawn))
    assert drawn[:, -1].std() == pytest.approx(np.sqrt(means(best)[0, -1]), rel=0.5)


def test_means_go_to_the_scale_and_back():
    values = np.array([[0.5, 3.0, 200.0]])
    for law in (Poisson(), law_of(relative(0.2))):
        scale = ByMean(law, values[0], np.array([1.0, 4.0, 9.0]))  # samples averaged
        np.testing.assert_allclose(scale.back(scale.of(values)), values, rtol=1e-9)
        # one sd is one
        step = scale.of(values + 0.05 * scale.sds(values)) - scale.of(values)
        np.testing.assert_allclose(step, 0.05, rtol=0.05)


def test_a_share_is_positive():
    with pytest.raises(ValueError, match="share must be positive"):
        inference.relative(0.0)


def test_a_run_without_noise_is_a_failed_run():
    def some(theta, seeds):
        found = means(theta)
        found[theta["a"] < 0.0] = 0.0
        return found

    fit = inference.fit(
        some, PRIOR, COUNTS + 1.0, budget=20, noise=relative(0.3), progress=False, warn=False
    )
    assert set(fit.failures) == {"incomparable"}
    assert any("positive, finite sd" in error for error in fit.history.errors)


def test_counts_where_next_to_none_are_expected():
    """Means may come close to 0 where something was counted."""
    time, prior = np.linspace(0.0, 5.0, 50), inference.Prior({"tau": dist.Uniform(0.1, 2.1)})
    counts = np.random.default_rng(0).poisson(np.exp(-time / 1.3))

    def expected(theta, seeds):
        return np.exp(-time / theta["tau"][:, None])

    fit = inference.fit(
        expected, prior, counts, noise="poisson", budget=20, progress=False, warn=False
    )
    tau = np.linspace(0.1, 2.1, 2001)[1:]
    mean = np.exp(-time / tau[:, None])
    log_density = (counts * np.log(mean) - mean).sum(1)
    weights = np.exp(log_density - log_density.max())
    weights /= weights.sum()
    exact = weights @ tau
    sd = np.sqrt(weights @ (tau - exact) ** 2)
    drawn = fit.sample("quadrature", warn=False)["posterior"]["tau"].to_numpy()
    assert abs(drawn.mean() - exact) < 0.4 * sd and 0.7 < drawn.std() / sd < 1.4
