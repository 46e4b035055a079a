"""Outputs as vectors, their components and the emulator of these."""

import tracemalloc

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.gp import process as gp
from bolfi_liquids.inference.gp.hyperparameters import NOISE
from bolfi_liquids.inference.gp.process import predict
from bolfi_liquids.inference.surrogates.emulator import (
    EmulatorLimits,
    emulate,
    learn_size,
    principal_components,
)
from bolfi_liquids.inference.surrogates.output_vectors import MAX_VALUES, describe
from scipy.special import softmax

from bolfi_liquids import inference


def test_channels_follow_each_other_and_missing_samples_are_left_out():
    observed = np.arange(40.0).reshape(20, 2)
    observed[[3, 7], 1] = np.nan
    output = describe(observed, None)
    values = output.values(np.arange(40.0).reshape(20, 2))
    np.testing.assert_array_equal(values[:20], np.arange(0.0, 40.0, 2.0))
    np.testing.assert_array_equal(values[20:24], [1.0, 3.0, 5.0, 9.0])
    assert (output.layout.channel == np.repeat([0, 1], [20, 18])).all()
    assert list(output.layout.sample[20:24]) == [0, 1, 2, 4]
    np.testing.assert_array_equal(output.restore(values[None])[0], observed)
    with pytest.raises(ValueError, match=r"output of shape \(20, 2\), as observed, got \(3,\)"):
        output.values(np.zeros(3))


def test_a_long_series_is_averaged_over_neighbours():
    m = 3 * MAX_VALUES
    output = describe(np.zeros(m), None)
    values = output.values(np.arange(m, dtype=float))
    assert len(values) == MAX_VALUES
    np.testing.assert_array_equal(values[:3], [1.0, 4.0, 7.0])
    np.testing.assert_array_equal(output.restore(values[None])[0, :4], [1.0, 1.0, 1.0, 4.0])


def test_a_channel_has_one_scale_and_each_value_of_a_summary_its_own():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(500, 40)) * np.repeat([1.0, 1e4], 20)
    scale = describe(np.zeros((20, 2)), None).scale(values)
    assert len(np.unique(scale)) == 2
    np.testing.assert_allclose(scale[[0, -1]], [1.0, 1e4], rtol=0.05)
    output = describe(np.zeros((30, 2)), lambda signal: np.array([signal.sum(), signal.max()] * 10))
    values = rng.normal(size=(8, 20)) * np.logspace(-6.0, 6.0, 20)
    np.testing.assert_allclose(output.scale(values), values.std(0))


@pytest.mark.parametrize(("n", "m"), [(9, 40), (200, 7)])
def test_components_are_those_of_the_singular_values(n, m):
    rng = np.random.default_rng(0)
    outputs = rng.normal(size=(n, m)) @ np.diag(0.7 ** np.arange(m)) + 3.0
    standard = (outputs - outputs.mean(0)) / 2.0
    _, sizes, right = np.linalg.svd(standard, full_matrices=False)
    shares = np.cumsum(sizes**2) / np.sum(sizes**2)
    # as few as explain the share, and no more than there is room for
    for basis, used in (
        (principal_components(outputs, np.full(m, 2.0), 5, 0.9999), 5),
        (principal_components(outputs, np.full(m, 2.0), 6, 0.999 * shares[2]), 3),
    ):
        exact = right[:used].T * sizes[:used] / np.sqrt(n)
        assert basis.used == used
        np.testing.assert_allclose(basis.vectors @ basis.vectors.T, exact @ exact.T, atol=1e-10)
        assert basis.explained == pytest.approx(shares[used - 1])
        scores = basis.scores(outputs)
        np.testing.assert_allclose(scores[:, :used].std(0), 1.0)
        left = standard - scores @ basis.vectors.T
        np.testing.assert_allclose(basis.residuals(outputs), left, atol=1e-10)
        assert not scores[:, used:].any()
    assert principal_components(np.ones((n, m)), np.ones(m), 4, 0.9995).used == 0


def test_many_simulations_of_few_values_need_no_matrix_of_simulations():
    """That matrix would hold 200 MB."""
    outputs = np.random.default_rng(0).normal(size=(5_000, 6))
    tracemalloc.start()
    try:
        basis = principal_components(outputs, np.ones(6), 8, 0.9995)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert basis.used == 6 and peak < 20 * outputs.nbytes


@pytest.mark.parametrize(("size", "share"), [(2.0, 0.09), (0.7, 0.46)])
def test_components_that_lean_towards_their_own_noise_do_not_steepen_the_emulator(size, share):
    """The mean score predicted at one parameter against that of many new runs there, over 60
    designs of 20 noisy runs of 200 values; unheeded, the emulator is up to twice too steep."""
    shape, u = np.linspace(-1.0, 1.0, 200), (np.arange(20)[:, None] + 0.5) / 20
    shape = size * shape / np.sqrt(np.mean(shape**2))
    theta, at, slopes, noise = u[:, 0] - 0.5, np.array([[0.2], [0.8]]), [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        outputs = theta[:, None] * shape + 0.8 * rng.normal(size=(20, 200))
        found = emulate(u, outputs, lambda outputs: np.ones(200), EmulatorLimits(1))
        expected = found.basis.scores((at - 0.5) * shape)[:, 0]
        mean = predict(found.gp, at)[0][0]
        slopes.append(np.diff(mean)[0] / np.diff(expected)[0])
        new = found.basis.scores(0.8 * rng.normal(size=(400, 200)) + found.basis.centre)
        noise.append(np.exp(found.gp.hyper.log_noise[0]) / new[:, 0].std())
        assert abs(found.excess[0] - share) < 0.5 * share
    error = np.std(slopes) / np.sqrt(len(slopes))
    second_order = share**2 / 2.0
    assert abs(np.mean(slopes) - 1.0) < 3.0 * error + second_order
    assert 1.0 / (1.0 - share) - 1.0 > 3.0 * error + second_order  # what the test can see
    assert abs(np.mean(noise) - 1.0) < 0.1 + second_order


def test_components_are_found_anew_where_what_they_came_from_changed():
    rng = np.random.default_rng(0)
    u = rng.uniform(size=(21, 1))
    outputs = u * np.sin(np.arange(40.0)) + u**2 + 0.1 * rng.normal(size=(21, 40))

    def learned(rows, previous=None):
        return emulate(u[rows], outputs[rows], lambda x: x.std(0), EmulatorLimits(3), previous)

    first = learned(np.arange(20))
    assert learned(np.arange(21), first).basis is first.basis
    left = np.delete(np.arange(21), 3)
    again, fresh = learned(left, first), learned(left)
    np.testing.assert_array_equal(again.basis.vectors, fresh.basis.vectors)
    np.testing.assert_array_equal(again.basis.scale, fresh.basis.scale)


@pytest.mark.parametrize("fades", [True, False])
def test_what_does_nothing_has_no_trend(monkeypatch, fades):
    """Prior sd of the change from the middle to the edge of a parameter that is 20 times as long
    as the box, against the sd of the noise that is expected of a score."""
    if not fades:
        monkeypatch.setattr(gp, "RELEVANT_LENGTH", np.inf)
    hyper = gp.Hyper(np.log([[0.3, 20.0]]), np.zeros(1), np.zeros(1))
    (prior,) = gp.covariance(hyper, *2 * [np.array([[0.4, 0.5], [0.4, 1.0]])])
    change = np.sqrt(prior[0, 0] + prior[1, 1] - 2.0 * prior[0, 1])
    assert (change < np.exp(NOISE[0])) == fades


def test_a_size_of_noise_by_the_parameters_is_found_where_there_is_one():
    rng = np.random.default_rng(0)
    u = rng.random((40, 2))
    error = 0.2 * rng.normal(size=40)
    found = learn_size(2.0 * u[:, 0] + error, u, None)
    rise = found.log(np.array([[0.9, 0.5]])) - found.log(np.array([[0.1, 0.5]]))
    assert rise[0] == pytest.approx(1.6, abs=0.3)
    assert learn_size(error, u, None) is None


def test_components_of_a_simulator_without_noise_are_no_noise_however_little_they_explain():
    """Of an outbreak whose height varies a thousandfold over the prior: what 0.05 % of its
    variance leaves would move the posterior."""
    days, sd = np.arange(1.0, 15.0), 18.0
    prior = inference.Prior({"rate": dist.Uniform(0.3, 3.0), "middle": dist.Uniform(3.0, 11.0)})

    def outbreak(theta, seeds):
        grown = np.exp(-theta["rate"][:, None] * (days - theta["middle"][:, None]))
        return 3000.0 * grown / (1.0 + grown) ** 2

    truth = {"rate": np.array([1.2]), "middle": np.array([6.3])}
    around = np.indices((100, 100)).reshape(2, -1).T / 50.0 - 1.0
    u = prior.to_unit(truth) + around * (0.06, 0.03)
    candidates, true = outbreak(prior.from_unit(u), None), outbreak(truth, None)[0]
    distances = []
    for seed in (0, 2):
        observed = true + sd * np.random.default_rng(seed).normal(size=days.size)
        fit = inference.fit(
            *(outbreak, prior, observed),
            **{"noise": sd, "budget": 40, "seed": seed},
            **{"confirm": 0, "warn": False, "progress": False},
        )
        exact = softmax(-0.5 * np.sum((candidates - observed) ** 2, axis=1) / sd**2)
        found = softmax(fit.learned.log_likelihood(u))
        distances.append(0.5 * np.abs(exact - found).sum())
    assert max(distances) < 0.1
