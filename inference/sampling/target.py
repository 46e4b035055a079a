"""The posterior as samplers see it, and what they have in common."""

from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from ..types import LogLikelihood
from .mixture import log_prior, to_unit

LOG_ZERO = -1e300
"""Log density in place of none: finite, so that differences of two are numbers."""
NOWHERE_FINITE = (
    "the log likelihood is finite nowhere in the prior's box; nothing can be sampled. "
    "Look at the surrogate's checks, and at the simulations that it learned from"
)
BATCH = 256  # evaluations in one call


class Target(NamedTuple):
    """A log likelihood over prior quantiles u [dimension]."""

    log_likelihood: LogLikelihood
    state: Any
    dimension: int


class Length(NamedTuple):
    """How long to sample."""

    chains: int
    warmup: int
    draws: int


class Chains(NamedTuple):
    """What a sampler yields."""

    u: np.ndarray  # [chain, draw, d], prior quantiles
    stats: dict[str, np.ndarray]  # name -> [chain, draw]


def log_density(log_likelihood: LogLikelihood, state: Any, x: jax.Array) -> jax.Array:
    """Log posterior density at x [d], u = Phi(x).

    The prior is uniform in u, so the Jacobian is a standard normal density: directions that
    the data leave open become standard normal, the easiest shape for a sampler.
    """
    return log_likelihood(state, to_unit(x)) + log_prior(x[None])[0]


@partial(jax.jit, static_argnums=0)
def _log_likelihoods(function: LogLikelihood, state: Any, u: jax.Array) -> jax.Array:
    return jax.vmap(function, in_axes=(None, 0))(state, u)


def log_likelihood(target: Target, u: np.ndarray) -> np.ndarray:
    """Log likelihood [n] at u [n, d], in padded batches, so that one shape is compiled; as it
    is, finite or not."""
    values = np.empty(len(u))
    for start in range(0, len(u), BATCH):
        rows = u[start : start + BATCH]
        padded = np.full((BATCH, u.shape[1]), 0.5)
        padded[: len(rows)] = rows
        batch = _log_likelihoods(target.log_likelihood, target.state, padded)
        values[start : start + BATCH] = np.asarray(batch)[: len(rows)]
    return values
