"""Fits that cannot be trusted say so; the same without the cause do not."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.warnings import (
    DOUBTED,
    FEW_NUMBERS,
    LOW_THRESHOLD,
    MISFIT,
    UNCONFIRMED,
)

from bolfi_liquids import inference

TIME = np.linspace(0.0, 5.0, 30)
DATA = 3.0 * np.exp(-0.8 * TIME) + 0.1 * np.random.default_rng(0).normal(size=30)
PRIOR = inference.Prior({"height": dist.Uniform(1, 6), "rate": dist.Uniform(0.1, 3)})


def decay(theta, seeds):
    return theta["height"][:, None] * np.exp(-theta["rate"][:, None] * TIME)


def warnings_of(simulate, observed, prior=PRIOR, budget=20, **options):
    fit = inference.fit(
        simulate, prior, observed, budget=budget, progress=False, warn=False, **options
    )
    return fit.warnings


@pytest.mark.parametrize(("noise", "said"), [(0.1, False), (0.01, True), (0.0, True)])
def test_noise_that_is_too_small_is_said(noise, said):
    assert (MISFIT in warnings_of(decay, DATA, noise=noise)) == said


@pytest.mark.parametrize(("numbers", "said"), [(3, True), (30, False)])
def test_too_few_numbers_to_tell_the_noise(numbers, said):
    def first(theta, seeds):
        return decay(theta, seeds)[:, :numbers]

    assert (FEW_NUMBERS in warnings_of(first, DATA[:numbers])) == said
    assert FEW_NUMBERS not in warnings_of(first, DATA[:numbers], noise=0.1)


@pytest.mark.parametrize(("threshold", "said"), [(1e-9, True), (None, False)])
def test_a_threshold_below_all_runs(threshold, said):
    def tall(theta, seeds):
        return decay({"height": np.full(len(seeds), 3.0), **theta}, seeds)

    rate = inference.Prior({"rate": dist.Uniform(0.05, 3)})
    found = warnings_of(tall, DATA, rate, surrogate="discrepancy", threshold=threshold)
    assert (LOW_THRESHOLD in found) == said


def circle(a):
    return np.stack([np.sin(6.0 * a), np.cos(6.0 * a)], -1)


@pytest.mark.parametrize(("end", "said"), [(0.3, True), (1.0, False)])
def test_a_posterior_where_nothing_was_simulated(end, said):
    """Data of beyond the prior's first third, and runs of that alone, or of all."""
    prior = inference.Prior({"a": dist.Uniform(0, 1)})
    a = np.linspace(0.0, end, round(20 * end))
    data = circle(np.array(0.4)) + [0.02, -0.03]
    options = {"noise": 0.05, "earlier": ({"a": a}, circle(a)), "progress": False, "warn": False}
    fit = inference.fit(None, prior, data, budget=0, **options)
    assert (fit.doubt > 1.5) == (DOUBTED in fit.warnings) == said
    assert fit.status == "not confirmed"  # nothing was run at draws of the posterior


def narrow(theta, seeds):
    """A line but for a bump, of which a few runs show nothing."""
    a = theta["a"][:, None]
    return np.concatenate([a, 3.0 * np.exp(-0.5 * ((a - 0.62) / 0.06) ** 2)], 1)


def test_runs_at_draws_of_the_posterior_confirm_it_or_move_it():
    prior = inference.Prior({"a": dist.Uniform(0, 1)})
    options = {"noise": 0.1, "progress": False, "warn": False}
    plain = inference.fit(lambda theta, seeds: circle(theta["a"]), prior, circle(0.4), **options)
    assert plain.confirmed and plain.status == "fitted" and len(plain.history.theta) == 23
    engine = inference.Bolfi(prior, circle(0.4), noise=0.1)
    a = np.linspace(0.0, 0.3, 6)
    engine.tell({"a": a}, circle(a))
    before = engine.fit(warn=False)
    assert before.confirmed is None
    drawn = engine.confirm(before, 4)
    assert len(np.unique(drawn["a"])) == 4
    with pytest.raises(ValueError, match="fit must be what"):
        engine.confirm(plain)
    engine.tell(drawn, circle(drawn["a"]))
    moved = engine.fit(warn=False)
    assert moved.confirmed is False and UNCONFIRMED in moved.warnings
    with pytest.raises(ValueError, match="after the last simulation"):
        engine.confirm(before)


def test_a_budget_is_exceeded_by_half_at_most():
    """By as many runs at draws as it takes; none if that is asked for."""
    prior = inference.Prior({"a": dist.Uniform(0, 1)})
    data = narrow({"a": np.array([0.62])}, None)[0]
    options = {"noise": 0.02, "budget": 8, "progress": False, "warn": False}
    for confirm, most in ((0, 8), (2, 12), (3, 11)):
        made = inference.fit(narrow, prior, data, confirm=confirm, **options)
        assert 8 + confirm <= len(made.history.theta) <= most
