"""Measurement noise that the user knows, over the values of an output."""

import numpy as np
from numpy.typing import ArrayLike

from .arguments import checked_array
from .output import Output


def given_noise(noise: ArrayLike, output: Output) -> np.ndarray:
    """Variances [m] of the values' noise where it is independent, else its covariance [m, m].

    Args:
        noise: As in `SignalFamily`: sd, sds or covariance of what was observed.
        output: How that becomes m values.

    Raises:
        ValueError: noise is none of these.
    """
    samples = len(output.present)
    given = checked_array("noise", noise)
    # from the order of the observed output to that of the values
    rank = np.argsort(np.argsort(output.present))
    if given.shape == (samples, samples):
        return _covariance(given, rank, output)
    if given.ndim < 2 and given.size == 1:
        sds = np.full(samples, given.item())
    elif given.shape == output.shape:
        sds = given.ravel()[output.present]
    elif given.shape == (samples,):
        sds = given[rank]
    else:
        raise ValueError(
            f"noise must be a number, sds of shape {output.shape} as observed or [{samples}], or a "
            f"[{samples}, {samples}] covariance, of the finite observed values, "
            f"got shape {given.shape}"
        )
    wrong = sds[~(np.isfinite(sds) & (sds >= 0.0))]
    if wrong.size:
        raise ValueError(
            f"noise must be finite and not negative where observed is finite, got {wrong[0]}"
        )
    return output.average(sds**2) / output.counts


def _covariance(given: np.ndarray, rank: np.ndarray, output: Output) -> np.ndarray:
    averaged = output.average(output.average(given[np.ix_(rank, rank)]).T)
    symmetric = np.isfinite(given).all() and np.allclose(given, given.T)
    # of the averages, which are few
    if not (symmetric and np.linalg.eigvalsh(averaged)[0] >= -1e-9 * np.abs(averaged).max()):
        raise ValueError("noise must be a finite, symmetric, positive semidefinite covariance")
    variances = np.diag(averaged)
    return variances.copy() if np.array_equal(averaged, np.diag(variances)) else averaged
