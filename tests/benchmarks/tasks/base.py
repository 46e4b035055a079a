"""What an engine and a scorer need to know of a task."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

TAIL = 1e-6
Theta = Mapping[str, np.ndarray]


def same(signals: np.ndarray) -> np.ndarray:
    return signals


def distance(observed: np.ndarray, simulated: np.ndarray) -> float:
    """Euclidean."""
    return float(np.linalg.norm(simulated - observed))


def log_normal(quantile: np.ndarray, log_median: float, log_sd: float) -> np.ndarray:
    """The value at a quantile: how a task states a prior that is not uniform."""
    inside = np.clip(quantile, TAIL, 1.0 - TAIL)  # some engines ask for the very ends
    return np.exp(log_median + log_sd * ndtri(inside))


@dataclass(frozen=True)
class Task:
    """A simulator with a uniform prior and a likelihood that can be evaluated.

    A parameter of another prior is given by its quantile in that prior, which is uniform.

    Attributes:
        name: Key in `TASKS`.
        ranges: Parameter -> (low, high); the prior is uniform on this box.
        simulate: (theta: name -> [b], seeds: [b]) -> signals [b, *signal_shape]. A row depends on
            its own theta and seed only.
        observe: data seed -> observed data, made at the task's true parameters.
        log_likelihood: (observed, theta: name -> [n]) -> exact log density of the data, [n], up to
            a constant.
        discrepancy: (observed, one signal [*signal_shape]) -> Delta.
        view: signals [b, *signal_shape] -> what a surrogate of the signal itself is given,
            [b, *view_shape].
        noise: Covariance of what the observed view carries beyond a simulated one,
            [view, view]; None where the simulator makes the data.
        gridded: Whether a grid resolves the posterior.
    """

    name: str
    ranges: Mapping[str, tuple[float, float]]
    simulate: Callable[[Theta, np.ndarray], np.ndarray]
    observe: Callable[[int], np.ndarray]
    log_likelihood: Callable[[np.ndarray, Theta], np.ndarray]
    discrepancy: Callable[[np.ndarray, np.ndarray], float] = distance
    view: Callable[[np.ndarray], np.ndarray] = same
    noise: np.ndarray | None = None
    gridded: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.ranges)

    @property
    def bounds(self) -> np.ndarray:
        """[d, 2]"""
        return np.array([self.ranges[name] for name in self.names], float)

    def theta(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """points [n, d] -> name -> [n]."""
        return {name: points[:, j] for j, name in enumerate(self.names)}


def normals(seeds: np.ndarray, *shape: int) -> np.ndarray:
    """Standard normal numbers [len(seeds), *shape], each row from its own seed."""
    return np.stack([np.random.default_rng(int(seed)).standard_normal(shape) for seed in seeds])
