"""lotka_volterra: prey X' = alpha X - beta X Y, predators Y' = delta X Y - gamma Y.

That of sbibm (Lueckmann et al. 2021, arXiv:2101.04653, T.10): X = 30, Y = 1 at first, both seen ten
times in 19 days with log-normal errors of sd 0.1, priors log-normal. Signals are logarithms.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from .base import Task, Theta, log_normal, normals
from .integrate import runge_kutta

TIMES = 2.1 * np.arange(10)  # d
STEP = 0.05  # d
SD = 0.1
LOG_MEDIAN = {"alpha": -0.125, "beta": -3.0, "gamma": -0.125, "delta": -3.0}
LOG_SD = 0.5
TRUTH = {"alpha": 0.69, "beta": 0.08, "gamma": 0.89, "delta": 0.08}
LOWEST, HIGHEST = np.log(1e-10), np.log(1e4)


def populations(theta: Theta) -> np.ndarray:
    """log X and log Y at `TIMES`, [b, 20]."""
    alpha, beta, gamma, delta = (
        log_normal(theta[f"u_{name}"], middle, LOG_SD) for name, middle in LOG_MEDIAN.items()
    )

    def rate(state: np.ndarray) -> np.ndarray:
        prey, predators = np.exp(np.minimum(state, HIGHEST))
        return np.stack([alpha - beta * predators, delta * prey - gamma])

    start = np.broadcast_to(np.log([[30.0], [1.0]]), (2, len(alpha)))
    states = np.clip(runge_kutta(rate, start, TIMES, STEP), LOWEST, HIGHEST)
    return np.moveaxis(states, -1, 0).reshape(len(alpha), -1)


def observe(seed: int) -> np.ndarray:
    """With errors, [20]."""
    truth = {
        f"u_{name}": ndtr(np.array([(np.log(value) - LOG_MEDIAN[name]) / LOG_SD]))
        for name, value in TRUTH.items()
    }
    return (populations(truth) + SD * normals(np.array([seed]), 2 * len(TIMES)))[0]


def log_likelihood(observed: np.ndarray, theta: Theta) -> np.ndarray:
    return -0.5 * np.sum((observed - populations(theta)) ** 2, axis=1) / SD**2


LOTKA_VOLTERRA = Task(
    name="lotka_volterra",
    ranges={f"u_{name}": (0.0, 1.0) for name in TRUTH},
    simulate=lambda theta, seeds: populations(theta),
    observe=observe,
    log_likelihood=log_likelihood,
    noise=SD**2 * np.eye(2 * len(TIMES)),
    gridded=False,
)
