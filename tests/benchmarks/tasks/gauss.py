"""gauss2: the mean of a bivariate normal distribution of known covariance."""

from __future__ import annotations

import numpy as np

from .base import Task, Theta, normals

SIZE = 20
COVARIANCE = np.array([[1.0, 0.5], [0.5, 1.0]])
TRUTH = {"a": np.array([0.7]), "b": np.array([-0.4])}


def simulate(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """Samples [b, 20, 2] of N((a, b), COVARIANCE)."""
    mean = np.stack([theta["a"], theta["b"]], axis=-1)
    return mean[:, None, :] + normals(seeds, SIZE, 2) @ np.linalg.cholesky(COVARIANCE).T


def observe(seed: int) -> np.ndarray:
    """[20, 2]"""
    return simulate(TRUTH, np.array([seed]))[0]


def discrepancy(observed: np.ndarray, simulated: np.ndarray) -> float:
    """Euclidean distance of the sample means."""
    return float(np.linalg.norm(observed.mean(axis=0) - simulated.mean(axis=0)))


def log_likelihood(observed: np.ndarray, theta: Theta) -> np.ndarray:
    """Of the sample mean, which is sufficient: N((a, b), COVARIANCE / 20)."""
    difference = np.stack([theta["a"], theta["b"]], axis=-1) - observed.mean(axis=0)
    precision = SIZE * np.linalg.inv(COVARIANCE)
    return -0.5 * np.einsum("ni,ij,nj->n", difference, precision, difference)


def sample_mean(signals: np.ndarray) -> np.ndarray:
    """[b, 20, 2] -> [b, 2]."""
    return signals.mean(axis=1)


GAUSS2 = Task(
    name="gauss2",
    ranges={"a": (-4.0, 4.0), "b": (-4.0, 4.0)},
    simulate=simulate,
    observe=observe,
    discrepancy=discrepancy,
    log_likelihood=log_likelihood,
    view=sample_mean,
)
