"""The posterior as samplers see it: a log density over unconstrained coordinates."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.stats import norm
from scipy.special import ndtri

from .base import LogLikelihood
from .design import sobol

SCREENED = 4096


def log_density(log_likelihood: LogLikelihood, state: Any, x: jax.Array) -> jax.Array:
    """Log posterior density at x [d], u = Phi(x).

    The prior is uniform in u, so the Jacobian is a standard normal density: directions that
    the data leave open become standard normal, the easiest shape for a sampler.
    """
    return log_likelihood(state, norm.cdf(x)) + jnp.sum(norm.logpdf(x))


@partial(jax.jit, static_argnums=0)
def log_likelihoods(log_likelihood: LogLikelihood, state: Any, u: jax.Array) -> jax.Array:
    """[n, d] -> [n]."""
    return jax.vmap(log_likelihood, in_axes=(None, 0))(state, u)


def dispersed_starts(
    key: jax.Array, log_likelihood: LogLikelihood, state: Any, shape: tuple[int, int]
) -> np.ndarray:
    """Starts x [n, d], drawn from the posterior restricted to points that fill the prior.

    Importance resampling without replacement (Gumbel top-n): every mode of some weight
    attracts chains, wherever in the prior it lies.
    """
    n, dimension = shape
    u = sobol(0, 0, max(SCREENED, 4 * n), dimension)
    scores = log_likelihoods(log_likelihood, state, u)
    noisy = np.asarray(scores + jax.random.gumbel(key, scores.shape))
    return ndtri(u[np.argsort(-noisy)[:n]])
