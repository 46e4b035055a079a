"""The posterior as samplers see it, and what they have in common."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..gp.namespaces import namespace, ndtr
from ..types import LogLikelihood

LOG_ZERO = -1e300
"""Log density in place of none: finite, so that differences of two are numbers."""
BATCH = 1024  # evaluations in one call, which bounds the memory


class Target(NamedTuple):
    """A log likelihood over prior quantiles u [dimension]."""

    log_likelihood: LogLikelihood
    dimension: int


class Length(NamedTuple):
    """Chains and their lengths."""

    chains: int
    warmup: int
    draws: int


class Chains(NamedTuple):
    """Draws of a sampler."""

    u: np.ndarray  # [chain, draw, d], prior quantiles
    stats: dict[str, np.ndarray]  # name -> [chain, draw]


def log_prior(x: Any) -> Any:
    """Standard normal log density at x [n, d]: [n]."""
    return -0.5 * namespace(x).sum(x**2, axis=-1) - 0.5 * x.shape[-1] * math.log(2.0 * math.pi)


def log_density(log_likelihood: LogLikelihood, x: Any) -> Any:
    """Log posterior density [n] at x [n, d], u = Phi(x), for arrays of NumPy or JAX.

    The prior is uniform in u, so the Jacobian is a standard normal density: directions that
    the data leave open become standard normal, the easiest shape for a sampler.
    """
    return log_likelihood(ndtr(x)) + log_prior(x)


def log_likelihood(target: Target, u: np.ndarray) -> np.ndarray:
    """Log likelihood [n] at u [n, d], as it is, finite or not."""
    values = np.empty(len(u))
    for start in range(0, len(u), BATCH):
        rows = slice(start, start + BATCH)
        values[rows] = target.log_likelihood(u[rows])
    return values


def somewhere_finite(values: np.ndarray) -> np.ndarray:
    """The log likelihoods of points that fill the prior, of which one must be finite.

    Raises:
        ValueError: none is.
    """
    if not (np.isfinite(values) & (values > 0.5 * LOG_ZERO)).any():
        raise ValueError(
            "the log likelihood is finite nowhere in the prior's box; nothing can be sampled. "
            "Look at the surrogate's checks, and at the simulations that it learned from"
        )
    return values
