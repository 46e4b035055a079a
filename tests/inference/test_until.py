"""A budget that ends when the posterior is known well enough."""

import itertools

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
    assert early.recipe.budget == inference.Until()  # a replicate ends by itself, too


def test_what_components_leave_is_no_noise_where_repeated_runs_agree():
    """Of a deterministic simulator that few components make badly."""

    def waves(theta, seeds):
        return theta["height"][:, None] * np.sin(4.0 * theta["rate"][:, None] * TIMES)

    truth = {"height": np.array([2.0]), "rate": np.array([0.7])}
    observed = waves(truth, None)[0] + NOISE * np.random.default_rng(0).normal(size=TIMES.size)
    fit = inference.fit(
        *(waves, PRIOR, observed),
        **{"noise": NOISE, "components": 3, "budget": 40},
        **{"confirm": 0, "warn": False, "progress": False},
    )
    u = np.random.default_rng(0).random((200_000, 2)) * (0.2, 0.02) + (0.4, 0.305)
    missed = waves(PRIOR.from_unit(u), None) - observed
    mass = np.exp(-0.5 * np.sum(missed**2, axis=1) / NOISE**2)
    exact_sd = np.sqrt(np.cov(u.T, aweights=mass).diagonal())
    found = fit.prior.to_unit(fit.quantiles((0.05, 0.95)))
    too_wide = np.max((found[1] - found[0]) / (3.29 * exact_sd))
    assert too_wide > 1.5  # or this shows nothing
    assert fit.interval_error() > 0.25


def test_a_family_of_one_s_own_is_not_known_to_be_known():
    class Silent(inference.SignalFamily):
        def learn(self, data, key):
            found = super().learn(data, key)
            object.__setattr__(
                found, "realisations", lambda rng, u, n: np.full((n, len(u)), np.nan)
            )
            return found

    fit = inference.fit(
        *(decay, PRIOR, OBSERVED),
        surrogate=Silent(noise=NOISE),
        budget=inference.Until(most=26),
        **{"confirm": 0, "warn": False, "progress": False},
    )
    assert np.isnan(fit.interval_error())
    assert len(fit.history.theta) == 26
    assert "interval ends" not in repr(fit)


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
    assert 35 <= len(fit.history.theta) < 45  # twice in a row


def test_one_look_below_the_tolerance_may_be_luck():
    errors = itertools.cycle([0.0, 1.0])
    fit = fitted(decay, budget=inference.Until(most=30, error=lambda fit: next(errors)))
    assert len(fit.history.theta) == 30


def broken(fit):
    raise KeyError("cup")


@pytest.mark.parametrize(
    ("error", "told"),
    [(lambda fit: None, "None"), (broken, "KeyError: 'cup'")],
)
def test_an_error_that_is_no_number_is_named_and_nothing_is_simulated_twice(error, told, tmp_path):
    calls = []

    def simulate(theta, seeds):
        calls.extend(seeds)
        return decay(theta, seeds)

    bank = tmp_path / "bank.sqlite"
    kept = {"bank": bank, "identity": "decay"}
    with pytest.raises(ValueError, match=rf"^error of Until .* 16 .*{told}.*{bank}"):
        fitted(simulate, budget=inference.Until(error=error), **kept)
    assert len(calls) == 16
    fitted(simulate, budget=inference.Until(most=26, error=lambda fit: np.nan), **kept)
    assert len(calls) == len(set(calls)) == 26


@pytest.mark.parametrize("budget", ["all", 0, None])
def test_a_budget_that_is_none_is_refused(budget):
    with pytest.raises(ValueError, match="budget must"):
        fitted(decay, budget=budget)
