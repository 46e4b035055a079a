"""Fits that cannot be trusted say so; the same without the cause do not."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.warnings import (
    FEW_NUMBERS,
    GUESSED,
    LOW_THRESHOLD,
    MISFIT,
    TOO_SMOOTH,
    UNEVEN,
    UNLEARNED,
    distance_warnings,
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
    """A steep corner that three runs in the middle of the prior say nothing of."""
    middle = {"a": np.array([0.45, 0.5, 0.55]), "b": np.array([0.5, 0.45, 0.55])}
    prior = inference.Prior({name: dist.Uniform(0, 1) for name in "ab"})
    outputs = np.stack([np.sin(9.0 * middle["a"]), middle["b"] ** 2], -1)
    few = warnings_of(None, [0.5, 2.0], prior, 0, noise=0.1, earlier=(middle, outputs))
    assert UNLEARNED in few
    u = np.random.default_rng(0).random((2, 60))
    many = np.stack([np.sin(9.0 * u[0]), u[1] ** 2], -1)
    theta = {"a": u[0], "b": u[1]}
    found = warnings_of(None, [0.5, 0.3], prior, 0, noise=0.1, earlier=(theta, many))
    assert UNLEARNED not in found


PAPER = {"surrogate": "discrepancy"}


@pytest.mark.parametrize("seed", range(3))
def test_a_sum_of_squares_gives_the_exact_posterior(seed):
    """Against a grid: independent noise whose size nothing tells but the residual."""
    fit = inference.fit(
        decay, PRIOR, DATA, budget=30, seed=seed, progress=False, warn=False, **PAPER
    )
    drawn = fit.sample("quadrature", warn=False)["posterior"]
    axes = np.meshgrid(np.linspace(2.5, 3.5, 201), np.linspace(0.6, 1.1, 201), indexing="ij")
    height, rate = (axis.ravel() for axis in axes)
    misfit = np.sum((decay({"height": height, "rate": rate}, None) - DATA) ** 2, 1)
    weights = np.exp(-15.0 * np.log(misfit / misfit.min()))
    for name, grid in (("height", height), ("rate", rate)):
        mean = np.average(grid, weights=weights)
        sd = np.sqrt(np.average((grid - mean) ** 2, weights=weights))
        assert abs(float(drawn[name].mean()) - mean) < sd
        assert 0.5 < float(drawn[name].std()) / sd < 3.0


def test_data_far_outside_are_said_by_the_discrepancy_too():
    assert any("far outside" in said for said in warnings_of(decay, DATA + 50.0, **PAPER))
    assert not any("far outside" in said for said in warnings_of(decay, DATA, **PAPER))


def test_a_discrepancy_of_one_number_leaves_the_width_to_guess():
    def loss(theta, seeds):
        return np.sum((decay(theta, seeds) - DATA) ** 2, 1)[:, None]

    own = {"discrepancy": lambda observed, simulated: float(simulated[0])}
    assert GUESSED in warnings_of(loss, [0.0], **own)
    assert GUESSED not in warnings_of(loss, [0.0], **own, threshold=0.4)


@pytest.mark.parametrize(("seen", "said"), [("few", UNEVEN), ("rough", TOO_SMOOTH), ("fair", None)])
def test_what_a_sum_of_squares_cannot_see_is_said(seen, said):
    rng = np.random.default_rng(0)
    noise, run = rng.normal(size=(4, 40)), np.linspace(0.0, 9.0, 40)
    size = {"few": 10.0 ** -np.linspace(0, 6, 40), "rough": 1.0, "fair": 1.0}[seen]
    sizes = np.array({"rough": [0.05, 1.0, 2.0]}.get(seen, [1.0, 1.0, 1.0]))
    outputs = run * np.array([1.0, 1.5, 2.0])[:, None] + size * sizes[:, None] * noise[:3]
    found = distance_warnings(run + size * noise[3], outputs)
    assert all((text in found) == (text == said) for text in (UNEVEN, TOO_SMOOTH))
