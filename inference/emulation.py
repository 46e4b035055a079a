"""A vector as a function of parameters, learned from runs that were made before."""

import numpy as np
from numpy.typing import ArrayLike

from ._float64 import in_float64
from .arguments import checked_array
from .prior import Prior
from .regression import finite_runs
from .surrogates import emulator as vectors
from .surrogates.emulator import Emulator, EmulatorLimits
from .types import Theta

COMPONENTS = 6  # at most; of smooth outputs later ones are noise


class Emulation:
    """Gaussian processes of the principal components of outputs [m]; see `emulate`.

    Attributes:
        prior: Of the parameters; its quantiles are what the processes know.
        left_out: What the other runs predict of each run, [n, m].
        missed: Output of each run less that, [n, m]: the error of the emulation, chance between
            runs included.
    """

    def __init__(self, prior: Prior, learned: Emulator):
        self.prior, self._learned = prior, learned
        self.left_out = vectors.left_out(learned)
        self.missed = learned.outputs - self.left_out

    @in_float64
    def predict(self, theta: Theta) -> np.ndarray:
        """Mean output [n, m] at theta, name -> [n]; outside the support, at its edge."""
        return vectors.mean(self._learned, np.atleast_2d(self.prior.to_unit(theta)))


@in_float64
def emulate(prior: Prior, theta: Theta, outputs: ArrayLike, scale: ArrayLike) -> Emulation:
    """Learn a vector as a function of parameters.

    No simulator is run, nothing is observed and nothing is sampled. Where the output is one
    number, `regress` says more of it.

    Args:
        prior: Gives names, ranges and scales of the parameters.
        theta: Name -> [n], in the prior's support.
        outputs: [n, m]; a row that is not finite is left out.
        scale: [m], positive: differences that count alike.

    Raises:
        ValueError: shapes disagree, fewer than three finite rows, theta outside the support, or a
            scale that is not positive.
    """
    weights = checked_array("scale", scale)
    u, known = finite_runs(prior, theta, "outputs", outputs, axes=2)
    if weights.shape != known.shape[1:] or not (weights > 0.0).all():
        raise ValueError(
            f"scale must hold {known.shape[1]} positive numbers, one per output, got shape "
            f"{weights.shape} and least {weights.min(initial=np.inf)}"
        )
    limits = EmulatorLimits(COMPONENTS, predicted=None)
    learned = vectors.emulate(u, known, lambda _: weights, limits, None, prior.normal)
    return Emulation(prior, learned)
