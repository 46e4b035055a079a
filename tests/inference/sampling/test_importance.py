"""The weighted population against posteriors whose moments and evidence are known."""

import re
from functools import partial

import numpy as np
import pytest
from bolfi_liquids.inference.sampling.importance import (
    Evidence,
    explore,
    fit_mixture,
    log_mixture,
)
from bolfi_liquids.inference.sampling.target import Target
from scipy.special import logsumexp, ndtr

SEEDS = 4


def two_gaussians(state, u):
    """Weight 0.8 at the first centre and 0.2 at the second, normalised over all space."""
    centres, whiteners, logs = state
    z = np.einsum("kij,nkj->nki", whiteners, u[:, None] - centres)
    volume = np.linalg.slogdet(whiteners)[1] - 0.5 * u.shape[1] * np.log(2.0 * np.pi)
    return logsumexp(logs + volume - 0.5 * np.sum(z**2, -1), axis=1)


def gaussian_state(d, sd):
    """One Gaussian, given twice: correlation 0.9 between neighbouring parameters."""
    index = np.arange(d)
    covariance = sd**2 * 0.9 ** np.abs(index[:, None] - index)
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    centre = np.linspace(0.4, 0.6, d)
    return np.stack([centre] * 2), np.stack([whitener] * 2), np.log([0.8, 0.2])


def bimodal_state(d, sd):
    centres = np.stack([np.full(d, 0.25), np.full(d, 0.75)])
    return centres, np.stack([np.eye(d) / sd] * 2), np.log([0.8, 0.2])


def explored(seed, state, d):
    return explore(np.random.default_rng(seed), Target(partial(two_gaussians, state), d))


def populations(state, d):
    """(u, normalised weights, log evidence) for each seed."""
    found = []
    for seed in range(SEEDS):
        made = explored(seed, state, d)
        log_evidence = logsumexp(made.log_weights)
        found.append((ndtr(made.x), np.exp(made.log_weights - log_evidence), log_evidence))
    return found


@pytest.mark.parametrize(("d", "sd"), [(1, 0.003), (3, 0.003), (6, 0.1)])
def test_moments_and_evidence_of_a_correlated_gaussian(d, sd):
    """At least 200 effective points: means to 0.3 sd and sds to 25 %, over 4 errors of 0.07
    and 0.05; a population that stopped a temperature too early is twice as wide. The
    evidence is biased low by some per cent per parameter, as adaptation does."""
    state = gaussian_state(d, sd)
    for u, weights, log_evidence in populations(state, d):
        mean = weights @ u
        assert 1.0 / np.sum(weights**2) > 200
        assert (np.abs(mean - state[0][0]) < 0.3 * sd).all()
        np.testing.assert_allclose(np.sqrt(weights @ (u - mean) ** 2), sd, rtol=0.25)
        assert abs(log_evidence) < 0.3


@pytest.mark.parametrize(("d", "sd"), [(1, 0.02), (6, 0.05)])
def test_weights_of_distant_modes(d, sd):
    """Half a box or more apart: no path leads from one to the other. At least 400 effective
    points: shares to 0.02, tested to 4 times that."""
    for u, weights, log_evidence in populations(bimodal_state(d, sd), d):
        assert abs(weights @ (u[:, 0] < 0.5) - 0.8) < 0.08
        assert abs(log_evidence) < 0.3


def test_without_any_information_it_is_the_prior():
    """A Gaussian a hundred boxes wide."""
    d = 6
    u, weights, log_evidence = populations(bimodal_state(d, 100.0), d)[0]
    assert abs(log_evidence + d * np.log(100.0 * np.sqrt(2.0 * np.pi))) < 0.05
    np.testing.assert_allclose(weights @ u, 0.5, atol=0.05)
    np.testing.assert_allclose(np.sqrt(weights @ (u - 0.5) ** 2), np.sqrt(1 / 12), atol=0.03)


def test_a_likelihood_that_fails_everywhere_is_refused():
    with np.errstate(all="ignore"), pytest.raises(ValueError, match="finite nowhere"):
        explored(0, bimodal_state(2, np.nan), 2)


def test_a_peak_costs_what_is_stated():
    costs = [len(explored(0, gaussian_state(2, sd), 2).x) for sd in (0.2, 0.003)]
    assert costs[0] <= 2048 and costs[1] <= 4096


def test_the_mixture_integrates_to_one():
    """By importance sampling from the prior, to 4 standard errors (10^5 points)."""
    rng = np.random.default_rng(0)
    x = np.concatenate([rng.normal(-1.0, 0.3, (448, 2)), rng.normal(1.0, 0.2, (64, 2))])
    mixture = fit_mixture(x, np.zeros(512), 0.5)
    points = rng.normal(size=(100_000, 2))
    prior = -0.5 * (points**2).sum(1) - np.log(2.0 * np.pi)
    ratio = np.exp(log_mixture(mixture, points) - prior)
    assert abs(ratio.mean() - 1.0) < 4.0 * ratio.std() / np.sqrt(len(points))


@pytest.mark.parametrize("error", [0.00010648, 0.010648, 3.1, 42.7])
def test_an_evidence_is_printed_to_what_its_error_leaves(error):
    log = -1234.567890123
    shown = re.findall(r"=([-\d.]+)", repr(Evidence(log, error)))
    assert len("".join(shown)) < 20
    np.testing.assert_allclose([float(one) for one in shown], [log, error], atol=0.5 * error)
