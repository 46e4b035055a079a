"""Posterior draws of a Gaussian process's hyperparameters."""

import numpy as np
from scipy.special import ndtri

from ..gp.hyperparameters import log_marginal_likelihood, prior_moments, unpack
from ..gp.process import Data, Hyper
from ..sampling.ensemble import sample_emcee
from ..sampling.target import Length, Target

CHAINS, WARMUP = 2, 50


def log_evidence(data: Data, v: np.ndarray) -> np.ndarray:
    """log p(y | hyper) of one process, at prior quantiles v [n, d + 2] of its hyperparameters."""
    mean, sd = prior_moments(data.u.shape[1])
    of_each = data._replace(y=np.tile(data.y, (len(v), 1)))
    return log_marginal_likelihood(unpack(mean + sd * ndtri(v)), of_each)[0]


def posterior_draws(data: Data, draws: int, seed: int) -> Hyper:
    """Hyperparameters [draws] by emcee, for the one process of `data`."""
    dimension = data.u.shape[1] + 2
    length = Length(CHAINS, WARMUP, -(-draws // CHAINS))
    target = Target(log_evidence, data, dimension)
    chains = next(sample_emcee(np.random.default_rng(seed), target, length))
    mean, sd = prior_moments(data.u.shape[1])
    return unpack((mean + sd * ndtri(chains.u)).reshape(-1, dimension)[:draws])
