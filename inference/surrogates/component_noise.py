"""How much run-to-run noise the principal components absorb."""

import numpy as np

from .components import Basis
from .measurement_noise import Remainder

MAX_ABSORBED_SHARE = 0.9  # of a score that may count as its own run's noise


def absorbed_noise(basis: Basis, noise: np.ndarray, remainder: Remainder, n: int) -> np.ndarray:
    """Share [k] of the scores of n runs that is these runs' own noise.

    A principal component leans towards the noise of the runs that it is computed from, so their
    scores contain that noise and a new run's do not: to first order by the noise's variance
    across the component over n times the component's variance (Nadler 2008, finite sample
    perturbation of principal components). Without a correction the emulator is too steep by that
    share, most of all in the weak components of few, long and noisy outputs.

    Args:
        noise: Run-to-run variances of the scores [k].
        remainder: What the components leave.
    """
    squared = np.sum(basis.vectors**2, 0)
    total = np.sum(noise * squared) + remainder.total
    across = np.maximum(total - noise * squared, 0.0)
    share = np.where(squared > 0.0, across / (n * np.where(squared > 0.0, squared, 1.0)), 0.0)
    return np.minimum(share, MAX_ABSORBED_SHARE)


def left_over(
    basis: Basis, noise: np.ndarray, remainder: Remainder, excess: np.ndarray
) -> Remainder:
    """`remainder`, plus the noise wrongly attributed to the components.

    Args:
        noise: Run-to-run variances of the scores, without the excess [k].
    """
    taken = np.sum(noise * ((1.0 - excess) ** -2 - 1.0) * np.sum(basis.vectors**2, 0))
    return remainder._replace(white=remainder.white + float(taken) / len(basis.vectors))
