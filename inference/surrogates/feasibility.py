"""Probability that a simulation succeeds, by kernel regression."""

from typing import NamedTuple

import numpy as np

KERNEL_WIDTH = 0.1  # in prior quantiles
PRIOR_SUCCESSES = 0.05  # successes that are assumed everywhere


class Feasibility(NamedTuple):
    """Runs so far."""

    u: np.ndarray  # [p, d]
    succeeded: np.ndarray  # bool [p]


def log_feasible(runs: Feasibility, u: np.ndarray) -> np.ndarray:
    """Log of the share of successes around u [..., d] (Nadaraya and Watson) [...]; 0 if nothing
    failed."""
    near = np.exp(-0.5 * np.sum(((runs.u - u[..., None, :]) / KERNEL_WIDTH) ** 2, axis=-1))
    good, bad = near @ runs.succeeded + PRIOR_SUCCESSES, near @ ~runs.succeeded
    return np.log(good) - np.log(good + bad)
