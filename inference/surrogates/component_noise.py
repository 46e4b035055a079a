"""Components lean towards the noise of the runs that they are made from: by how much."""

import numpy as np

from .components import Basis
from .measurement_noise import Remainder

MOST = 0.9  # of a score that may count as its own run's noise


def own_noise(basis: Basis, noise: np.ndarray, remainder: Remainder, n: int) -> np.ndarray:
    """Share [k] of their own noise in what components made from n runs show of these.

    A component leans towards the noise of the runs that made it, and so do their scores, which
    a new run's do not: to first order by the noise's variance across it over n times its own
    variance (Nadler 2008, finite sample perturbation of principal components). Unheeded, the
    emulator is too steep by that share, most of all in the weak components of few, long and
    noisy outputs.

    Args:
        noise: Run-to-run variances of the scores [k].
        remainder: What the components leave.
    """
    squared = np.sum(basis.vectors**2, 0)
    total = np.sum(noise * squared) + remainder.total
    across = np.maximum(total - noise * squared, 0.0)
    share = np.where(squared > 0.0, across / (n * np.where(squared > 0.0, squared, 1.0)), 0.0)
    return np.minimum(share, MOST)


def left_over(
    basis: Basis, noise: np.ndarray, remainder: Remainder, excess: np.ndarray
) -> Remainder:
    """`remainder`, and the noise that only seemed to be the components'.

    Args:
        noise: Run-to-run variances of the scores, without the excess [k].
    """
    taken = np.sum(noise * ((1.0 - excess) ** -2 - 1.0) * np.sum(basis.vectors**2, 0))
    return remainder._replace(white=remainder.white + float(taken) / len(basis.vectors))
