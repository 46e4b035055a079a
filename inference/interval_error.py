"""How far the surrogate's doubt may move the posterior's intervals."""

import numpy as np
from scipy.special import ndtr

from .sampling.importance import LEAST, Population, weighted_quantiles
from .surrogates.base import Surrogate
from .types import LogLikelihood

POINTS = 400  # of the posterior, at which simulators are drawn together
REALISATIONS = 64  # simulators that the runs allow
ENDS = 0.05, 0.95  # of a 90 % interval


def interval_error(found: Population, was: LogLikelihood, learned: Surrogate) -> float:
    """Root mean square, over simulators that the runs allow, of the difference between an end of
    the 90 % interval if the simulator were known and the end that is reported; the largest of all
    parameters' ends, in the posterior's sds. Both are taken in prior quantiles.

    Args:
        found: The posterior of the likelihood `was`.
        learned: The surrogate that allows the simulators and reports the ends.
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
    missed = np.stack([_ends(u, log_weights + one) for one in known]) - reported
    return float(np.max(np.sqrt(np.mean(missed**2, 0)) / _sd(u, counts)))


def _ends(u: np.ndarray, log_weights: np.ndarray) -> np.ndarray:
    """Of points u [n, d] with log weights [n]: [2, d]."""
    weights = np.exp(log_weights - log_weights.max())
    return np.stack([weighted_quantiles(values, weights, ENDS) for values in u.T], axis=1)


def _sd(u: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Of points u [n, d] with weights [n]: [d]."""
    mean = np.average(u, axis=0, weights=weights)
    return np.maximum(np.sqrt(np.average((u - mean) ** 2, axis=0, weights=weights)), LEAST)
