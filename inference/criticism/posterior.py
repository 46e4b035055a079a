"""The posterior of a hypothesis, as a few draws and as intervals."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from .._float64 import in_float64
from ..sampling.importance import explore, weighted_quantiles
from ..sampling.target import Target
from .hypothesis import Hypothesis


class Interval(NamedTuple):
    """Of one parameter."""

    mean: float
    q05: float
    q95: float


class Weighted(NamedTuple):
    """Points of a posterior in natural units, name -> [n], and their weights [n]."""

    theta: dict[str, np.ndarray]
    weights: np.ndarray

    def draw(self, seed: int, count: int) -> dict[str, np.ndarray]:
        """A systematic sample along the first parameter, name -> [count]."""
        order = np.argsort(next(iter(self.theta.values())))
        reached = np.cumsum(self.weights[order])
        start = np.random.default_rng(seed).random()
        at = np.searchsorted(reached, (start + np.arange(count)) / count * reached[-1])
        chosen = order[np.minimum(at, len(order) - 1)]
        return {name: values[chosen] for name, values in self.theta.items()}

    def interval(self, name: str) -> Interval:
        """Mean and 90 % interval of a parameter."""
        values = self.theta[name]
        low, high = weighted_quantiles(values, self.weights, (0.05, 0.95))
        mean = np.average(values, weights=self.weights)
        return Interval(float(mean), float(low), float(high))


@in_float64
def weighted_posterior(hypothesis: Hypothesis, seed: int = 0) -> Weighted:
    """Adaptive importance sampling of a hypothesis's posterior, see `importance.explore`."""
    surrogate, prior = hypothesis.surrogate, hypothesis.fit.prior
    target = Target(surrogate.log_likelihood, len(prior))
    found = explore(np.random.default_rng(seed), target)
    used = np.isfinite(found.log_weights)
    weights = np.exp(found.log_weights[used] - found.log_weights[used].max())
    theta = prior.from_unit(ndtr(found.x[used]))
    return Weighted(theta, weights / weights.sum())
