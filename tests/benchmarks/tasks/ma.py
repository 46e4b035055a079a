"""ma2: a moving average of order 2, y[t] = w[t] + t1 w[t-1] + t2 w[t-2] with w standard normal.

The prior is uniform on the triangle where t1, t2 can be identified: |t1| < 1 + t2, t2 < 1. Its
coordinates here are u1, u2, uniform on the unit square: u2 is the quantile of t2, u1 that of t1
given t2. The map has a constant Jacobian, so that densities with respect to the prior, and with
them total variation, are the same in both.
"""

from __future__ import annotations

import numpy as np

from .base import Task, Theta, normals

STEPS = 100
TRUTH = (0.6, 0.2)


def from_square(u1: np.ndarray, u2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """t1, t2 of u1, u2. The density of t2 is (1 + t2) / 2, its distribution (1 + t2)^2 / 4."""
    height = 2.0 * np.sqrt(u2)
    return (2.0 * u1 - 1.0) * height, height - 1.0


def to_square(t1: np.ndarray, t2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """u1, u2 of t1, t2 in the triangle; inverse of `from_square`."""
    return (t1 / (1.0 + t2) + 1.0) / 2.0, ((1.0 + t2) / 2.0) ** 2


def series(t1: np.ndarray, t2: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """y [b, 100] at t1, t2 [b], in the triangle or not."""
    w = normals(seeds, STEPS + 2)
    return w[:, 2:] + t1[:, None] * w[:, 1:-1] + t2[:, None] * w[:, :-2]


def simulate(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """[b, 100]"""
    return series(*from_square(theta["u1"], theta["u2"]), seeds)


def observe(seed: int) -> np.ndarray:
    """[100]"""
    return series(*(np.array([value]) for value in TRUTH), np.array([seed]))[0]


def autocovariances(signals: np.ndarray) -> np.ndarray:
    """Mean lagged products of lag 1 and 2 (the series' mean is known to be 0), [b, 2]."""
    lags = [(signals[:, lag:] * signals[:, :-lag]).mean(axis=1) for lag in (1, 2)]
    return np.stack(lags, axis=1)


def discrepancy(observed: np.ndarray, simulated: np.ndarray) -> float:
    """Euclidean distance of the autocovariances of lag 1 and 2."""
    first, second = autocovariances(np.stack([observed, simulated]))
    return float(np.linalg.norm(first - second))


def log_likelihood(observed: np.ndarray, theta: Theta) -> np.ndarray:
    """Of the whole series: normal with a Toeplitz covariance of bandwidth 2.

    Its Cholesky factor L has three diagonals, of which a row needs the two rows above only, as
    does the forward substitution L z = y.
    """
    t1, t2 = from_square(theta["u1"], theta["u2"])
    lag0, lag1, lag2 = 1.0 + t1**2 + t2**2, t1 * (1.0 + t2), t2
    zero, one = np.zeros_like(t1), np.ones_like(t1)
    diagonal, side = [one, one], zero  # diagonals of the two rows above, L[i-1, i-2]
    z = [zero, zero]
    total = zero
    for i, y in enumerate(observed):
        below = lag2 / diagonal[0] if i > 1 else zero
        next_side = (lag1 - below * side) / diagonal[1] if i > 0 else zero
        pivot = np.sqrt(lag0 - below**2 - next_side**2)
        white = (y - below * z[0] - next_side * z[1]) / pivot
        total = total - np.log(pivot) - 0.5 * white**2
        diagonal, side, z = [diagonal[1], pivot], next_side, [z[1], white]
    return total


MA2 = Task(
    name="ma2",
    ranges={"u1": (0.0, 1.0), "u2": (0.0, 1.0)},
    simulate=simulate,
    observe=observe,
    discrepancy=discrepancy,
    log_likelihood=log_likelihood,
    view=autocovariances,
)
