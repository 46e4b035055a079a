"""A number or a vector as a function of parameters, learned from runs that were made before."""

import numpy as np
from numpy.typing import ArrayLike

from ._float64 import in_float64
from .arguments import checked_array
from .prior import Prior, check_support, checked_prior
from .surrogates import emulator as vectors
from .surrogates.base import SurrogateView
from .surrogates.discrepancy import DiscrepancySurrogate, learn
from .surrogates.emulator import Emulator, EmulatorLimits
from .surrogates.transform import Transform, check_transform
from .types import Theta

COMPONENTS = 6  # at most; of smooth outputs later ones are noise
MIN_VALUES = 3  # finite values from which a process can be learned


class Regression(SurrogateView):
    """A Gaussian process on g(value), in the prior's natural units; see `regress`."""

    learned: DiscrepancySurrogate

    @property
    def transform(self) -> Transform:
        """g: called with values; `transform.inverse` leads back."""
        return self.learned.transform


@in_float64
def regress(
    prior: Prior, theta: Theta, values: ArrayLike, transform: str | None = None
) -> Regression:
    """Learn a number as a function of parameters, by a Gaussian process over prior quantiles.

    No simulator is run, nothing is observed and nothing is sampled: use it for a cost, a
    success rate or a duration that was recorded with each run.

    Args:
        prior: Gives names, ranges and scales of the parameters.
        theta: Name -> [n], in the prior's support.
        values: [n]; what is not finite is left out.
        transform: g: "identity", "sqrt" or "log"; None chooses by leave-one-out log predictive
            density.

    Returns:
        `predict(theta)` gives mean and sd of a new g(value), its noise included; `transform` is
        g; `warnings` is what leave-one-out errors say against it.

    Raises:
        ValueError: shapes disagree, fewer than three finite values, theta outside the support,
            or a transform that is undefined at some value.
    """
    check_transform(transform)
    u, known = _finite_runs(prior, theta, "values", values, axes=1)
    return Regression(prior, learn(u, known, transform, normal=prior.normal))


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
    u, known = _finite_runs(prior, theta, "outputs", outputs, axes=2)
    if weights.shape != known.shape[1:] or not (weights > 0.0).all():
        raise ValueError(
            f"scale must hold {known.shape[1]} positive numbers, one per output, got shape "
            f"{weights.shape} and least {weights.min(initial=np.inf)}"
        )
    limits = EmulatorLimits(COMPONENTS, predicted=None)
    learned = vectors.emulate(u, known, lambda _: weights, limits, None, prior.normal)
    return Emulation(prior, learned)


def _finite_runs(
    prior: Prior, theta: Theta, name: str, values: ArrayLike, axes: int
) -> tuple[np.ndarray, np.ndarray]:
    """Prior quantiles [k, d] and values, [k] or with two axes [k, m], of finite runs.

    Raises:
        ValueError: shapes disagree, fewer than three finite runs, or theta outside the support.
    """
    checked_prior(prior)
    rows = prior.to_dict(np.atleast_2d(prior.to_array(theta)))
    known, n = checked_array(name, values), len(next(iter(rows.values())))
    due = f"({n},), one per theta" if axes == 1 else f"({n}, m), a row per theta"
    if known.ndim != axes or len(known) != n:
        raise ValueError(f"{name} must have shape {due}, got {known.shape}")
    finite = np.isfinite(known.reshape(n, -1)).all(axis=1)
    if finite.sum() < MIN_VALUES:
        raise ValueError(
            f"{name} must be finite for {MIN_VALUES} theta, got {finite.sum()} of {n}; make more"
        )
    check_support(prior, rows)
    return prior.to_unit(rows)[finite], known[finite]
