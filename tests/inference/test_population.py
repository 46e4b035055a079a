"""The weighted population against posteriors whose moments and evidence are known."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.population import explore, population
from scipy.special import logsumexp

SEEDS = 5
CASES = [(1, 0.1), (2, 0.003), (3, 0.003), (4, 0.05), (6, 0.1)]


def gaussian(state, u):
    """Correlated: sd `scale`, correlation 0.9 between neighbours."""
    centre, whitener = state
    z = whitener @ (u - centre)
    return -0.5 * z @ z


def two_modes(state, u):
    """Weight 0.8 at `low`, 0.2 at `high`, each a Gaussian density of the same sd."""
    low, high, sd = state
    squares = [-0.5 * jnp.sum(((u - centre) / sd) ** 2) for centre in (low, high)]
    norm = -len(u) * jnp.log(sd * jnp.sqrt(2.0 * jnp.pi))
    return jnp.logaddexp(jnp.log(0.8) + squares[0], jnp.log(0.2) + squares[1]) + norm


def nowhere(state, u):
    return jnp.log(-1.0 - u.sum())  # NaN over the whole box


def covariance(d, sd):
    index = np.arange(d)
    return sd**2 * 0.9 ** np.abs(index[:, None] - index)


@in_float64
def populations(log_likelihood, state, d):
    """(u, normalised weights, log evidence) for each key."""
    for seed in range(SEEDS):
        u, log_weights = population(jax.random.key(seed), log_likelihood, state, d)
        log_evidence = logsumexp(log_weights)
        yield np.asarray(u), np.exp(np.asarray(log_weights) - log_evidence), log_evidence


@pytest.mark.parametrize(("d", "sd"), CASES)
def test_moments_and_evidence_of_a_correlated_gaussian(d, sd):
    """At least 200 effective points: means to 0.3 sd and sds to 25 %, over 4 errors of 0.07
    and 0.05; a population that stopped a temperature too early is twice as wide."""
    centre, cov = np.linspace(0.4, 0.6, d), covariance(d, sd)
    state = (centre, np.linalg.inv(np.linalg.cholesky(cov)))
    exact = 0.5 * np.linalg.slogdet(2.0 * np.pi * cov)[1]
    for u, weights, log_evidence in populations(gaussian, state, d):
        mean = weights @ u
        assert 1.0 / np.sum(weights**2) > 200
        assert (np.abs(mean - centre) < 0.3 * sd).all()
        np.testing.assert_allclose(np.sqrt(weights @ (u - mean) ** 2), sd, rtol=0.25)
        assert abs(log_evidence - exact) < 0.3


@pytest.mark.parametrize(("d", "sd"), [(1, 0.02), (2, 0.02), (4, 0.02)])
def test_weights_of_distant_modes(d, sd):
    """Half a box or more apart: no path leads from one to the other."""
    state = (np.full(d, 0.25), np.full(d, 0.75), np.asarray(sd))
    for u, weights, log_evidence in populations(two_modes, state, d):
        share = weights @ (u[:, 0] < 0.5)
        assert abs(share - 0.8) < 4.0 * np.sqrt(0.16 * np.sum(weights**2))
        assert abs(log_evidence) < 0.3


@pytest.mark.parametrize("d", [1, 5])
def test_without_any_information_it_is_the_prior(d):
    u, weights, log_evidence = next(populations(gaussian, (np.zeros(d), np.zeros((d, d))), d))
    assert abs(log_evidence) < 0.05
    np.testing.assert_allclose(weights @ u, 0.5, atol=0.05)
    np.testing.assert_allclose(np.sqrt(weights @ (u - 0.5) ** 2), np.sqrt(1 / 12), atol=0.03)


def test_a_likelihood_that_fails_everywhere_leaves_the_prior():
    u, weights, _ = next(populations(nowhere, (), 2))
    assert np.isfinite(weights).all()
    np.testing.assert_allclose(weights @ u, 0.5, atol=0.05)


@in_float64
def test_a_narrow_peak_costs_no_more_than_stated():
    found = [
        explore(
            jax.random.key(0), gaussian, (np.full(2, 0.5), np.eye(2) / sd), 2
        ).evaluations.item()
        for sd in (0.2, 0.003)
    ]
    assert found[0] < 2000
    assert found[1] <= 4096


@in_float64
def test_compiles_once_and_repeats():
    traces = []

    def counted(state, u):
        traces.append(None)
        return gaussian(state, u)

    results = []
    for width in (0.2, 0.1, 0.2):
        state = (np.full(2, 0.5), np.eye(2) / width)
        results.append(population(jax.random.key(0), counted, state, 2)[0])
    assert len(traces) == 1
    np.testing.assert_array_equal(results[0], results[2])
    assert not np.array_equal(results[0], results[1])
