"""Densities of single values against densities of all values and of all but one."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.pointwise import covariances
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from bolfi_liquids import inference

TIME = np.linspace(0.0, 1.0, 20)
PRIOR = inference.Prior({"level": dist.Uniform(-1.0, 1.0), "rate": dist.LogUniform(0.2, 10.0)})


def curve(theta, seeds):
    mean = theta["level"][:, None] + np.exp(-theta["rate"][:, None] * TIME)
    return mean + np.stack([0.05 * np.random.default_rng(s).normal(size=20) for s in seeds])


@pytest.fixture(scope="module", params=[None, 0.2], ids=["unknown noise", "a misfit beside noise"])
def learned(request):
    """Of noisy runs, and of data with an outlier."""
    observed = curve({"level": np.array([0.2]), "rate": np.array([1.0])}, [3])[0]
    observed = observed + 0.3 * np.sin(9.0 * TIME)
    observed[7] += 1.5
    how = {"budget": 20, "confirm": 0, "progress": False, "warn": False, "noise": request.param}
    return inference.fit(curve, PRIOR, observed, **how).learned


def log_densities(learned, u, kept):
    """Log density [n] of the observed values `kept`, nodes and scores integrated out."""
    emulator, nodes = learned.emulator, learned.nodes
    basis, given = emulator.basis, learned.known
    factors, white = emulator.remainder.factors, np.full(20, emulator.remainder.white)
    if given is not None:
        white = white + given.white / basis.scale**2
    mean = (emulator.mean(u) - basis.centre) / basis.scale
    target = basis.standardise(learned.observed)
    found = np.empty((len(u), len(nodes.sigma)))
    for g, noise in enumerate(covariances(factors, white, learned.output.layout, nodes)):
        for i, at in enumerate(u):
            latent = emulator.latent_covariance(at) / np.outer(basis.scale, basis.scale)
            latent = latent + basis.vectors @ emulator.noise @ basis.vectors.T
            whole = (noise + latent)[np.ix_(kept, kept)]
            found[i, g] = multivariate_normal.logpdf(target[kept] - mean[i, kept], cov=whole)
    return logsumexp(found + learned.log_prior, axis=1) - np.log(basis.scale[kept]).sum()


def test_a_value_s_density_is_that_of_all_values_over_that_of_the_others(learned):
    assert learned.emulator.size is None and len(learned.nodes.sigma) > 1
    u = np.random.default_rng(0).uniform(0.2, 0.8, (3, 2))
    every = np.arange(20)
    whole = log_densities(learned, u, every)
    expected = [whole - log_densities(learned, u, np.delete(every, i)) for i in every]
    np.testing.assert_allclose(learned.pointwise(u)["signal"], np.transpose(expected), atol=1e-6)
    # the likelihood is this density, but for the weight of nodes that it leaves out
    missing = learned.log_likelihood(u) + learned.log_constant - whole
    assert np.ptp(missing) < 1e-6
