"""Runs of a cheap simulator beside a few dear ones: exact posteriors are the judge."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.sampling.nuts import padded
from bolfi_liquids.inference.sobol import sobol

from bolfi_liquids import inference

TIME = np.linspace(0.0, 6.0, 61)[1:]
SD = 0.05
PRIOR = inference.Prior({"start": dist.LogUniform(0.5, 2.0), "rate": dist.LogUniform(0.1, 5.0)})
CELLS = (np.arange(60) + 0.5) / 60
GRID = PRIOR.from_unit(np.stack(np.meshgrid(CELLS, CELLS), -1).reshape(-1, 2))
SEEDS = range(5)


def decay(theta, seeds=None):
    return theta["start"][:, None] * np.exp(-theta["rate"][:, None] * TIME)


def euler(theta):
    """The same by Euler's method in steps of 0.1: the fastest decay is 40 % too fast."""
    return theta["start"][:, None] * (1.0 - 0.1 * theta["rate"][:, None]) ** np.arange(1, 61)


def too_fast(theta):
    return decay({**theta, "rate": 1.5 * theta["rate"]})


def other_law(theta):
    return np.sin(3.0 * theta["rate"][:, None] * TIME) * theta["start"][:, None]


def backwards(theta):
    return decay(PRIOR.from_unit(1.0 - PRIOR.to_unit(theta)))


def noise(theta):
    return np.random.default_rng(1).normal(size=(len(theta["rate"]), 60))


def told(seed, cheap, dear=12):
    """An engine that knows `dear` runs, and 60 of the simulator `cheap`."""
    rng = np.random.default_rng(seed)
    observed = decay(PRIOR.from_unit(rng.uniform(0.1, 0.9, (1, 2))))[0] + rng.normal(0.0, SD, 60)
    there = PRIOR.from_unit(sobol(seed + 50, 0, 60, 2))
    runs = None if cheap is None else (there, cheap(there))
    engine = inference.Bolfi(PRIOR, observed, seed=seed, noise=SD, cheap=runs)
    theta = PRIOR.from_unit(sobol(seed, 0, dear, 2))
    engine.tell(theta, decay(theta))
    return engine


def normalised(log_density):
    weight = np.exp(log_density - log_density.max())
    return weight / weight.sum()


def error(cheap):
    """Total variation between the posterior and the exact one, mean over SEEDS."""
    found = []
    for seed in SEEDS:
        fit = told(seed, cheap).fit(warn=False)
        mine = fit.learned.log_likelihood(PRIOR.to_unit(GRID))
        exact = -0.5 * np.sum(((decay(GRID) - fit.observed) / SD) ** 2, axis=1)
        found.append(0.5 * np.abs(normalised(mine) - normalised(exact)).sum())
    return np.mean(found)


@pytest.fixture(scope="module")
def alone():
    return error(None)


def test_coarse_time_steps_make_twelve_runs_enough(alone):
    assert alone > 0.4
    assert error(euler) < 0.3 * alone


def test_the_same_law_at_another_value_is_moved_to_where_it_is_right(alone):
    """With slope and offset alone 0.6 of the error stay."""
    assert error(too_fast) < 0.2 * alone


@pytest.mark.parametrize("cheap", [other_law, backwards, noise])
def test_a_simulator_that_misleads_does_no_harm(alone, cheap):
    assert error(cheap) < 1.1 * alone


def test_runs_that_say_nothing_change_no_bit():
    one, other = (told(0, cheap).fit(warn=False).learned for cheap in (None, noise))
    u = PRIOR.to_unit(GRID)
    np.testing.assert_array_equal(one.log_likelihood(u), other.log_likelihood(u))


def test_the_search_and_the_file_know_cheap_runs(tmp_path):
    """Points are asked, NUTS has a gradient to follow, and a stored fit is learned again."""
    engine = told(0, euler)
    for n in (3, 1):  # the last is learned with the components and hyperparameters from before
        theta = engine.ask(n)
        engine.tell(theta, decay(theta))
    fit = engine.fit(warn=False)
    assert engine._learned.gp.prior is not None
    u, step = fit.learned.best(), np.array([1e-5, 0.0])
    likelihood = fit.learned.log_likelihood
    with jax.enable_x64(True):
        traced = jax.jit(jax.grad(lambda at: padded(likelihood)(at[None])[0]))
        slope = traced(jnp.asarray(u + 0.05))
    above, below = (likelihood((u + 0.05 + sign * step)[None])[0] for sign in (1.0, -1.0))
    assert float(slope[0]) == pytest.approx((above - below) / 2e-5, rel=1e-4)
    path = fit.save(tmp_path / "decay.fit")
    again = inference.Fit.load(path, cheap=engine.family.cheap)
    np.testing.assert_array_equal(again.log_prob(GRID), fit.log_prob(GRID))
    with pytest.raises(ValueError, match="cheap"):
        inference.Fit.load(path)


def test_failed_cheap_runs_are_left_out():
    kept = np.arange(60) % 3 != 0
    failed = told(0, lambda theta: np.where(kept[:, None], euler(theta), np.nan)).fit(warn=False)
    there, signals = told(0, euler).family.cheap
    fewer = {name: column[kept] for name, column in there.items()}, signals[kept]
    engine = inference.Bolfi(PRIOR, failed.observed, noise=SD, cheap=fewer)
    theta = PRIOR.to_dict(failed.history.theta)
    engine.tell(theta, decay(theta))
    found = engine.fit(warn=False)
    np.testing.assert_array_equal(found.log_prob(GRID), failed.log_prob(GRID))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda theta, signals: (theta, signals[:, :50]), "signals must"),
        (lambda theta, signals: (theta, signals[:50]), "signals must"),
        (lambda theta, signals: ({"rate": theta["rate"]}, signals), "start"),
        (lambda theta, signals: ({**theta, "rate": theta["rate"] + 5.0}, signals), "support"),
        (lambda theta, signals: (theta, np.full_like(signals, np.nan)), "cheap must"),
        (lambda theta, signals: signals, "cheap must"),
    ],
)
def test_cheap_runs_that_cannot_be_used_are_refused_at_once(change, why):
    theta = PRIOR.from_unit(sobol(0, 0, 60, 2))
    with pytest.raises(ValueError, match=why):
        inference.Bolfi(PRIOR, decay(theta)[0], cheap=change(theta, euler(theta)))
