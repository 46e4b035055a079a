"""ball_drop: drag coefficient and gravity from the times in which a ball fell 20, 40 and 60 m.

The ball of 0.0485 m of LANL's SEPIA, examples/Ball_Drop/data/data_ball_drop_2.
"""

from __future__ import annotations

import numpy as np

from .base import Task, Theta

RADIUS, DENSITY, AIR = 0.0485, 380.9, 1.184  # m, kg/m^3, kg/m^3
HEIGHTS = np.array([20.0, 40.0, 60.0])  # m
TIMES = np.array([2.1502001, 3.1681314, 3.9311893])  # s
SD = 0.1  # s


def times(theta: Theta) -> np.ndarray:
    """Seconds [b, 3]: t = arccosh(exp(k h)) / sqrt(g k) with k = 3 AIR C / (8 RADIUS DENSITY)."""
    k = 3.0 * AIR * theta["C"][:, None] / (8.0 * RADIUS * DENSITY)
    return np.arccosh(np.exp(k * HEIGHTS)) / np.sqrt(theta["g"][:, None] * k)


def log_likelihood(observed: np.ndarray, theta: Theta) -> np.ndarray:
    return -0.5 * np.sum((observed - times(theta)) ** 2, axis=1) / SD**2


BALL_DROP = Task(
    name="ball_drop",
    ranges={"C": (0.2, 2.0), "g": (8.0, 12.0)},
    simulate=lambda theta, seeds: times(theta),
    observe=lambda seed: TIMES,
    log_likelihood=log_likelihood,
    noise=SD**2 * np.eye(len(TIMES)),
)
