"""A budget that ends when the posterior is known well enough."""

import numpy as np
import numpyro.distributions as dist
import pytest

from bolfi_liquids import inference

TIMES = np.linspace(0.0, 3.0, 12)
NOISE = 0.1
PRIOR = inference.Prior({"height": dist.Uniform(0, 4), "rate": dist.Uniform(0.1, 2)})


def decay(theta, seeds):
    return theta["height"][:, None] * np.exp(-theta["rate"][:, None] * TIMES)


def bumpy(theta, seeds):
    """Of a scale that no budget here resolves."""
    return decay(theta, seeds) + np.sin(60.0 * theta["rate"] * theta["height"])[:, None]


OBSERVED = decay({"height": np.array([2.0]), "rate": np.array([0.7])}, None)[0]
OBSERVED = OBSERVED + NOISE * np.random.default_rng(0).normal(size=TIMES.size)


def fitted(simulate, **how):
    return inference.fit(
        simulate, PRIOR, OBSERVED, noise=NOISE, confirm=0, warn=False, progress=False, **how
    )


def exact_ends(cells=400):
    """5 and 95 % quantiles of the exact posterior [2, 2], in prior quantiles."""
    u = (np.arange(cells) + 0.5) / cells
    grid = np.stack([axis.ravel() for axis in np.meshgrid(u, u, indexing="ij")], axis=-1)
    missed = decay(PRIOR.from_unit(grid), None) - OBSERVED
    mass = np.exp(-0.5 * np.sum(missed**2, axis=1) / NOISE**2).reshape(cells, cells)
    ends = []
    for axis in (1, 0):
        reached = np.cumsum(mass.sum(axis)) / mass.sum()
        ends.append(np.interp((0.05, 0.95), reached, u))
    return np.array(ends)


def test_what_is_known_after_few_runs_ends_early_and_is_right():
    fit = fitted(decay, budget=inference.Until(tolerance=0.1, most=60))
    assert len(fit.history.theta) < 40
    assert fit.interval_error() <= 0.1
    draws = np.stack(list(fit.sample("quadrature")["posterior"].values()))
    u = PRIOR.to_unit(dict(zip(PRIOR.names, draws.reshape(2, -1), strict=True)))
    off = np.quantile(u, (0.05, 0.95), axis=0).T - exact_ends()
    assert np.all(np.abs(off) < 0.25 * u.std(0)[:, None])


def test_it_stops_where_a_fixed_budget_would_have_come_to_the_same():
    early = fitted(decay, budget="auto")
    again = fitted(decay, budget=len(early.history.theta))
    np.testing.assert_array_equal(early.history.theta, again.history.theta)
    assert early.recipe.budget == again.recipe.budget


@pytest.mark.parametrize("in_rounds", [True, False])
def test_what_is_not_known_takes_the_whole_budget(in_rounds):
    fit = fitted(bumpy, budget=inference.Until(most=26), in_rounds=in_rounds)
    assert len(fit.history.theta) == 26


@pytest.mark.parametrize("surrogate", ["signal", "discrepancy"])
def test_more_runs_promise_less_doubt(surrogate):
    options = {"noise": NOISE} if surrogate == "signal" else {}
    how = {"surrogate": surrogate, "confirm": 0, "warn": False, "progress": False}
    fit = inference.fit(decay, PRIOR, OBSERVED, budget=12, **how, **options)
    assert fit.interval_error(50) < 0.7 * fit.interval_error()


def test_a_likelihood_that_is_known_everywhere_leaves_no_doubt():
    u = np.random.default_rng(0).random((60, 2))
    values = -50.0 * np.sum((u - 0.5) ** 2, axis=1)
    earlier = PRIOR.from_unit(u), values
    fit = inference.fit(
        None, PRIOR, surrogate="log_likelihood", budget=0, earlier=earlier, warn=False
    )
    assert fit.interval_error() < 0.05


def test_the_error_may_be_a_decision_s():
    def regret(fit):
        return 1.0 if len(fit.history.theta) < 30 else 0.0

    fit = fitted(decay, budget=inference.Until(tolerance=0.5, most=60, error=regret))
    assert 30 <= len(fit.history.theta) < 40


@pytest.mark.parametrize("budget", ["all", 0, None])
def test_a_budget_that_is_none_is_refused(budget):
    with pytest.raises(ValueError, match="budget must"):
        fitted(decay, budget=budget)
