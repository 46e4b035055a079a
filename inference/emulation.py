"""A vector as a function of parameters, learned from runs that were made before."""

import numpy as np
from numpy.typing import ArrayLike

from ._float64 import in_float64
from .arguments import checked_array, require
from .prior import Prior, check_support, checked_prior
from .surrogates import emulator as vectors
from .surrogates.emulator import Emulator, EmulatorLimits
from .types import Theta

COMPONENTS = 6  # at most; of smooth outputs later ones are noise
MIN_VALUES = 3  # finite rows from which a process can be learned


class Emulation:
    """Gaussian processes of the principal components of outputs [m]; see `emulate`.

    Attributes:
        prior: Of the parameters; its quantiles are what the processes know.
        left_out: What the other runs predict of each run, [n, m]; NaN of one that is not finite.
        missed: Output of each run less that, [n, m]: the error of the emulation, chance between
            runs included.
    """

    def __init__(self, prior: Prior, learned: Emulator, outputs: np.ndarray):
        self.prior, self._learned = prior, learned
        self.left_out = np.full_like(outputs, np.nan)
        self.left_out[np.isfinite(outputs).all(axis=1)] = learned.left_out()
        self.missed = outputs - self.left_out

    @in_float64
    def predict(self, theta: Theta) -> np.ndarray:
        """Mean output [n, m] at theta, name -> [n]; outside the support, at its edge."""
        return self._learned.mean(np.atleast_2d(self.prior.to_unit(theta)))


@in_float64
def emulate(prior: Prior, theta: Theta, outputs: ArrayLike, scale: ArrayLike) -> Emulation:
    """Learn a vector as a function of parameters.

    No simulator is run, nothing is observed and nothing is sampled.

    Args:
        prior: Gives names, ranges and scales of the parameters.
        theta: Name -> [n], in the prior's support.
        outputs: [n, m]; nothing is learned from a row that is not finite.
        scale: [m], positive and finite: differences that count alike.

    Raises:
        ValueError: shapes disagree, fewer than three finite rows, theta outside the support, or a
            scale that is not positive and finite.

    Example:
        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids import inference
        >>> prior = inference.Prior({"decay": dist.LogUniform(0.1, 10)})
        >>> time = np.linspace(0, 5, 50)
        >>> theta = {"decay": np.geomspace(0.1, 10, 12)}
        >>> outputs = np.exp(-theta["decay"][:, None] * time)
        >>> emulation = inference.emulate(prior, theta, outputs, scale=np.full(50, 0.05))
        >>> error = emulation.predict({"decay": np.array([2.0])})[0] - np.exp(-2.0 * time)
        >>> bool(abs(error).max() < 0.02)
        True
    """
    rows = checked_prior(prior).to_dict(np.atleast_2d(prior.to_array(theta)))
    known, weights = checked_array("outputs", outputs), checked_array("scale", scale)
    n = len(next(iter(rows.values())))
    alike = known.ndim == 2 and len(known) == n and known.size
    require(alike, "outputs", f"have shape ({n}, m), a row per theta", known.shape)
    finite = np.isfinite(known).all(axis=1)
    usable = int(finite.sum())
    due = f"be finite for {MIN_VALUES} theta"
    require(usable >= MIN_VALUES, "outputs", due, usable, cure="make more")
    check_support(prior, rows)
    positive = weights.shape == known.shape[1:] and ((weights > 0.0) & (weights < np.inf)).all()
    due = f"hold {known.shape[1]} positive and finite numbers, one per output"
    require(positive, "scale", due, weights)
    limits, u = EmulatorLimits(COMPONENTS, predicted=None), prior.to_unit(rows)[finite]
    learned = vectors.emulate(u, known[finite], lambda _: weights, limits, None, prior.tails)
    return Emulation(prior, learned, known)
