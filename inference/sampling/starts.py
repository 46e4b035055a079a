"""What samplers take from a population: where to start, and how wide the posterior is."""

import numpy as np

from .importance import Population

SEPARATE_MODES_GAIN = 0.5  # in mean log density over one Gaussian: modes then count as separate


def resampled(rng: np.random.Generator, found: Population, n: int) -> np.ndarray:
    """n different points x [n, d], drawn by weight (Gumbel top-n): every mode of some weight
    attracts some of them, wherever in the prior it lies."""
    noisy = found.log_weights + rng.gumbel(size=len(found.x))
    return found.x[np.argsort(-noisy)[:n]]


def spread_factor(found: Population) -> np.ndarray:
    """Cholesky factor [d, d] of the covariance; of the modes' average one, where they are so
    separate that one Gaussian describes the population far worse than the mixture."""
    weights = np.exp(found.log_weights - found.log_weights.max())
    weights /= weights.sum()
    x = found.x
    centred = x - weights @ x
    covariance = centred.T @ (centred * weights[:, None])
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, centred.T)
    constant = np.log(np.diag(factor)).sum() + 0.5 * x.shape[1] * np.log(2.0 * np.pi)
    gaussian = -0.5 * np.sum(white**2, axis=0) - constant
    used = weights > 0.0
    gain = weights[used] @ (found.log_proposal - gaussian)[used]
    return factor if gain < SEPARATE_MODES_GAIN else local_factor(found)


def local_factor(found: Population) -> np.ndarray:
    """Cholesky factor of the components' average covariance."""
    shares, factors = np.exp(found.mixture.log_share), found.mixture.factor
    return np.linalg.cholesky(np.einsum("k,kij,klj->il", shares, factors, factors))
