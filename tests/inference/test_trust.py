"""Fits that cannot be trusted say so; the same without the cause do not."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.warnings import (
    DOUBTED,
    FEW_NUMBERS,
    LOW_THRESHOLD,
    MISFIT,
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


def test_a_posterior_where_nothing_was_simulated():
    """Data of a corner of the prior, and runs in its middle alone."""
    prior = inference.Prior({name: dist.Uniform(0, 1) for name in "ab"})
    u = 0.4 + 0.2 * np.random.default_rng(0).random((2, 12))
    outputs = np.stack([np.sin(9.0 * u[0]), u[1] ** 2], -1)
    middle = {"a": u[0], "b": u[1]}
    few = warnings_of(None, [0.78, 0.8], prior, 0, noise=0.1, earlier=(middle, outputs))
    assert DOUBTED in few
    u = np.random.default_rng(0).random((2, 60))
    many = np.stack([np.sin(9.0 * u[0]), u[1] ** 2], -1)
    theta = {"a": u[0], "b": u[1]}
    found = warnings_of(None, [0.5, 0.3], prior, 0, noise=0.1, earlier=(theta, many))
    assert DOUBTED not in found
