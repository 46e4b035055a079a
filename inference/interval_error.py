"""Error of the posterior's intervals that the surrogate's uncertainty allows."""

import numpy as np
from scipy.special import ndtr

from .sampling.importance import LEAST, Population, weighted_quantiles
from .surrogates.base import Surrogate
from .types import LogLikelihood

POINTS = 400  # of the posterior, at which simulators are drawn together
REALISATIONS = 64  # draws of what is emulated
ENDS = 0.05, 0.95  # of a 90 % interval


def interval_error(found: Population, was: LogLikelihood, learned: Surrogate) -> float:
    """Error of the ends of 90 % intervals, the largest of all parameters', in the posterior's sds.

    It is the root mean square difference between the reported end and that under a draw of what is
    emulated; and, to that, the difference to the end under the surrogate's `sure` likelihood, in
    which what no repeated run bears out as noise is no noise. All are taken in prior quantiles.

    Args:
        found: The posterior of the likelihood `was`.
        learned: The surrogate that reports the ends.

    Returns:
        NaN where the surrogate has no `realisations`.
    """
    rng = np.random.default_rng(0)
    places = (np.arange(POINTS) + 0.5) / POINTS
    which, counts = np.unique(
        np.minimum(np.searchsorted(np.cumsum(found.weights), places), len(found.x) - 1),
        return_counts=True,
    )
    u, log_weights = ndtr(found.x[which]), np.log(counts) - was(ndtr(found.x[which]))
    reported = _ends(u, log_weights + learned.log_likelihood(u))
    known = learned.realisations(rng, u, REALISATIONS)
    if np.isnan(known).any():
        return np.nan
    missed = np.stack([_ends(u, log_weights + one) for one in known]) - reported
    without = _ends(u, log_weights + learned.sure(u)) - reported
    return float(np.max(np.sqrt(np.mean(missed**2, 0) + without**2) / _sd(u, counts)))


def _ends(u: np.ndarray, log_weights: np.ndarray) -> np.ndarray:
    """Of points u [n, d] with log weights [n]: [2, d]."""
    weights = np.exp(log_weights - log_weights.max())
    return np.stack([weighted_quantiles(values, weights, ENDS) for values in u.T], axis=1)


def _sd(u: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Of points u [n, d] with weights [n]: [d]."""
    mean = np.average(u, axis=0, weights=weights)
    return np.maximum(np.sqrt(np.average((u - mean) ** 2, axis=0, weights=weights)), LEAST)
