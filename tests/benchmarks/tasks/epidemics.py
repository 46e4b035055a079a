"""sir and boarding_school: S' = -beta S I / N, I' = beta S I / N - gamma I.

sir is that of sbibm (Lueckmann et al. 2021, arXiv:2101.04653, T.9): ten binomial counts of an
epidemic among a million, priors log-normal. boarding_school: pupils in bed on the days after the
first, of 763 (British Medical Journal 1:587, 1978; numbers as read off its figure by textbooks).
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, xlog1py, xlogy

from .base import Task, Theta, log_normal
from .integrate import runge_kutta

DAYS = np.arange(0.0, 160.0, 17.0)
COUNTED = 1000
STEP = 0.2  # d
LOG_MEDIAN = {"beta": np.log(0.4), "gamma": np.log(0.125)}
LOG_SD = {"beta": 0.5, "gamma": 0.2}
SIR_TRUTH = {"beta": 0.61479264, "gamma": 0.19172086}  # of sbibm's first observation

PUPILS = 763
IN_BED = np.array([3, 8, 28, 76, 222, 293, 257, 237, 192, 126, 70, 28, 12, 5], float)
SD = 18.0  # about that of the residuals of the best fit; given, not inferred


def infectious(beta: np.ndarray, gamma: np.ndarray, size: float, days: np.ndarray) -> np.ndarray:
    """I / size of an epidemic that one person starts, [b, days]."""

    def rate(state: np.ndarray) -> np.ndarray:
        new, gone = beta * state[0] * state[1], gamma * state[1]
        return np.stack([-new, new - gone])

    start = np.broadcast_to([[1.0 - 1.0 / size], [1.0 / size]], (2, len(beta)))
    return runge_kutta(rate, start, days, STEP)[:, 1].T


def quantiles() -> dict[str, np.ndarray]:
    """`SIR_TRUTH` in its prior, each [1]."""
    return {
        f"u_{name}": ndtr(np.array([(np.log(value) - LOG_MEDIAN[name]) / LOG_SD[name]]))
        for name, value in SIR_TRUTH.items()
    }


def share(theta: Theta) -> np.ndarray:
    """I / N on `DAYS`, [b, 10]."""
    beta, gamma = (
        log_normal(theta[f"u_{name}"], LOG_MEDIAN[name], LOG_SD[name]) for name in LOG_SD
    )
    return np.clip(infectious(beta, gamma, 1e6, DAYS), 0.0, 1.0)


def counts(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """Binomial(1000, I / N) on `DAYS`, [b, 10]."""
    rows = zip(seeds, share(theta))  # noqa: B905  older Pythons
    drawn = [np.random.default_rng(int(seed)).binomial(COUNTED, p) for seed, p in rows]
    return np.array(drawn, float)


def binomial(observed: np.ndarray, theta: Theta) -> np.ndarray:
    p = share(theta)
    return np.sum(xlogy(observed, p) + xlog1py(COUNTED - observed, -p), axis=1)


def in_bed(theta: Theta) -> np.ndarray:
    """Pupils [b, 14]."""
    days = 1.0 + np.arange(len(IN_BED))
    return PUPILS * infectious(theta["beta"], theta["gamma"], PUPILS, days)


def normal(observed: np.ndarray, theta: Theta) -> np.ndarray:
    return -0.5 * np.sum((observed - in_bed(theta)) ** 2, axis=1) / SD**2


SIR = Task(
    name="sir",
    ranges={"u_beta": (0.0, 1.0), "u_gamma": (0.0, 1.0)},
    simulate=counts,
    observe=lambda seed: counts(quantiles(), np.array([seed]))[0],
    log_likelihood=binomial,
)
BOARDING_SCHOOL = Task(
    name="boarding_school",
    ranges={"beta": (1.0, 3.0), "gamma": (0.2, 1.0)},
    simulate=lambda theta, seeds: in_bed(theta),
    observe=lambda seed: IN_BED,
    log_likelihood=normal,
    noise=SD**2 * np.eye(len(IN_BED)),
)
