"""Posterior draws of a Gaussian process's hyperparameters."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtri
from scipy.special import ndtri as scipy_ndtri

from ..gp.hyperparameters import prior_moments, unpack
from ..gp.process import Data, Hyper, log_marginal_likelihood
from ..sampling.nuts import sample_nuts
from ..sampling.target import Length, Target

CHAINS, WARMUP = 2, 300


def log_evidence(data: Data, v: jax.Array) -> jax.Array:
    """log p(y | hyper) of one process, at prior quantiles v [d + 2] of its hyperparameters."""
    mean, sd = prior_moments(data.u.shape[1])
    return log_marginal_likelihood(unpack(jnp.asarray(mean + sd * ndtri(v))[None]), data)[0]


def posterior_draws(data: Data, draws: int, seed: int) -> Hyper:
    """Hyperparameters [draws] by NUTS, for the one process of `data`."""
    dimension = data.u.shape[1] + 2
    length = Length(CHAINS, WARMUP, -(-draws // CHAINS))
    target = Target(log_evidence, data, dimension)
    chains = next(sample_nuts(np.random.default_rng(seed), target, length))
    mean, sd = prior_moments(data.u.shape[1])
    x = scipy_ndtri(chains.u).reshape(-1, dimension)[:draws]
    return unpack(jnp.asarray(mean + sd * x))
