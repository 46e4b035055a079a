"""pendobs and pendobs3: the same pendulum without process noise, its angle measured with error."""

from __future__ import annotations

import numpy as np

from .base import Task, Theta, normals
from .pendulum import RANGES, START, STIFFNESS, TRUTH, conservative

SAMPLES = 180
INTERVAL = 1.0 / 30.0  # s, between samples
SUBSTEPS = 4
ROWS = 4096  # rows integrated at once, so that they stay in the processor's cache


def _ar1() -> np.ndarray:
    """Covariance of the measurement noise [rad^2]."""
    lag = np.abs(np.subtract.outer(np.arange(SAMPLES), np.arange(SAMPLES)))
    return 0.05**2 * 0.6**lag


def _smooth() -> np.ndarray:
    """Covariance of the jitter that every run carries [rad^2]."""
    lag = np.subtract.outer(np.arange(SAMPLES), np.arange(SAMPLES))
    return 0.01**2 * np.exp(-0.5 * (lag / 5.0) ** 2)


def _square_root(covariance: np.ndarray) -> np.ndarray:
    """The symmetric one: unlike other factors it depends on no library's choice of signs."""
    values, vectors = np.linalg.eigh(covariance)
    return (vectors * np.sqrt(np.clip(values, 0.0, None))) @ vectors.T


MEASUREMENT, JITTER = _ar1(), _smooth()
MEASUREMENT_ROOT, JITTER_ROOT = _square_root(MEASUREMENT), _square_root(JITTER)
WHITENING = np.linalg.inv(np.linalg.cholesky(MEASUREMENT + JITTER))


def angles(theta: Theta) -> np.ndarray:
    """Angle [rad] at 1/30, 2/30, ... 6 s by explicit Euler steps of 1/120 s, [b, 180]."""
    c1, c2 = theta["c1"], theta["c2"]
    stiffness = theta.get("stiffness", STIFFNESS)
    step = INTERVAL / SUBSTEPS
    out = np.empty((SAMPLES, len(c1)))
    angle, rate = np.full(len(c1), START), np.zeros(len(c1))
    for i in range(SAMPLES * SUBSTEPS):
        drag = (c1 + c2 * np.abs(rate)) * rate
        acceleration = conservative(i * step, angle, stiffness) - drag
        angle, rate = angle + step * rate, rate + step * acceleration
        if (i + 1) % SUBSTEPS == 0:
            out[i // SUBSTEPS] = angle
    return out.T


def simulate(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """Angles with jitter, without measurement noise, [b, 180]."""
    return angles(theta) + normals(seeds, SAMPLES) @ JITTER_ROOT


def observe(seed: int) -> np.ndarray:
    """Angles with jitter and measurement noise, [180]."""
    jitter, noise = normals(np.array([seed]), 2, SAMPLES)[0]
    return angles(TRUTH)[0] + JITTER_ROOT @ jitter + MEASUREMENT_ROOT @ noise


def discrepancy(observed: np.ndarray, simulated: np.ndarray) -> float:
    """Integral of the squared difference [rad^2 s]."""
    return float(np.sum((simulated - observed) ** 2) * INTERVAL)


def log_likelihood(observed: np.ndarray, theta: Theta) -> np.ndarray:
    """Normal about the angles, with the covariances of noise and jitter added."""
    n = len(theta["c1"])
    total = np.empty(n)
    for first in range(0, n, ROWS):
        rows = slice(first, first + ROWS)
        part = {name: column[rows] for name, column in theta.items()}
        white = (observed - angles(part)) @ WHITENING.T
        total[rows] = -0.5 * np.sum(white**2, axis=1)
    return total


PENDOBS = Task(
    name="pendobs",
    ranges=RANGES,
    simulate=simulate,
    observe=observe,
    discrepancy=discrepancy,
    log_likelihood=log_likelihood,
    noise=MEASUREMENT,
)
PENDOBS3 = Task(
    name="pendobs3",
    ranges={**RANGES, "stiffness": (16.0, 24.0)},
    simulate=simulate,
    observe=observe,
    discrepancy=discrepancy,
    log_likelihood=log_likelihood,
    noise=MEASUREMENT,
)
