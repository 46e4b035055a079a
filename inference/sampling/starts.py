"""What samplers take from a population: where to start, and how wide the posterior is."""

import jax
import numpy as np

from .importance import Population, explore
from .target import NOWHERE_FINITE, Target

SEPARATE_MODES_GAIN = 0.5  # in mean log density over one Gaussian: modes then count as separate


def look_around(rng: np.random.Generator, target: Target) -> Population:
    """The population of the posterior.

    Raises:
        ValueError: the log likelihood was finite nowhere.
    """
    found = explore(jax.random.key(int(rng.integers(2**31))), *target)
    if not np.isfinite(found.log_likelihood).any():
        raise ValueError(NOWHERE_FINITE)
    return found


def resampled(rng: np.random.Generator, found: Population, n: int) -> np.ndarray:
    """n different points x [n, d], drawn by weight (Gumbel top-n): every mode of some weight
    attracts some of them, wherever in the prior it lies."""
    log_weights = np.asarray(found.log_weights)
    noisy = log_weights + rng.gumbel(size=len(log_weights))
    return np.asarray(found.x)[np.argsort(-noisy)[:n]]


def spread_factor(found: Population) -> np.ndarray:
    """Cholesky factor [d, d] of the covariance; of the modes' average one, where they are so
    separate that one Gaussian describes the population far worse than the mixture."""
    log_weights = np.asarray(found.log_weights)
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    x = np.asarray(found.x)
    centred = x - weights @ x
    covariance = centred.T @ (centred * weights[:, None])
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, centred.T)
    constant = np.log(np.diag(factor)).sum() + 0.5 * x.shape[1] * np.log(2.0 * np.pi)
    gaussian = -0.5 * np.sum(white**2, axis=0) - constant
    used = weights > 0.0
    gain = weights[used] @ (np.asarray(found.log_proposal) - gaussian)[used]
    return factor if gain < SEPARATE_MODES_GAIN else local_factor(found)


def local_factor(found: Population) -> np.ndarray:
    """Cholesky factor of the components' average covariance."""
    shares = np.exp(np.asarray(found.mixture.log_share))
    factors = np.asarray(found.mixture.factor)
    return np.linalg.cholesky(np.einsum("k,kij,klj->il", shares, factors, factors))
