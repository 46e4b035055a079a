"""Where runs succeed: the probability of it is a factor of the likelihood."""

from typing import Any, NamedTuple

import numpy as np

from ..gp.hyperparameters import maximum_a_posteriori
from ..gp.namespaces import log_ndtr, namespace
from ..gp.process import GP, Data, condition, padded, padded_rows, predict

KERNEL_WIDTH = 0.1  # in prior quantiles
PRIOR_SUCCESSES = 0.05  # successes that are assumed everywhere
BEST_SHARE = 0.25  # of the runs, which tell how far discrepancies spread
MAX_DEVIATIONS = 1e6  # of that spread


class Feasibility(NamedTuple):
    """Runs so far."""

    u: np.ndarray  # [p, d]
    succeeded: np.ndarray  # bool [p]


def sane(discrepancy: np.ndarray) -> np.ndarray:
    """Which of the discrepancies [n] are not absurdly larger than the best quarter, bool [n]; NaN
    is. Most runs may have blown up, or hold a number such as 1e16 in place of infinity."""
    deviation = discrepancy - np.nanmin(discrepancy, initial=np.inf)
    finite = deviation[np.isfinite(deviation)]
    spread = np.quantile(finite, BEST_SHARE) if finite.size else 0.0
    return ~(deviation > MAX_DEVIATIONS * spread) | (spread == 0.0)


def log_feasible(runs: Feasibility, u: np.ndarray) -> np.ndarray:
    """Log of the share of successes around u [..., d] (Nadaraya and Watson) [...]; 0 if nothing
    failed."""
    near = np.exp(-0.5 * np.sum(((runs.u - u[..., None, :]) / KERNEL_WIDTH) ** 2, axis=-1))
    good, bad = near @ runs.succeeded + PRIOR_SUCCESSES, near @ ~runs.succeeded
    return np.log(good) - np.log(good + bad)


def learn_success(runs: Feasibility, normal: np.ndarray | None) -> GP | None:
    """A process of +1 where a run succeeded and -1 where it failed; None if none failed.

    Least-squares classification (Rasmussen and Williams 2006, section 6.5): what is random in the
    failures becomes the process's noise, a border becomes a zero of its mean.
    """
    if runs.succeeded.all():
        return None
    data = Data(runs.u, np.where(runs.succeeded, 1.0, -1.0)[None], normal)
    return condition(maximum_a_posteriori(data), data)


def log_success(gp: GP | None, u: Any) -> Any:
    """Log probability [n] that a run at u [n, d] succeeds, Phi(mean / sd) of a new label."""
    xp = namespace(u)
    if gp is None:
        return xp.zeros(len(u))
    mean, variance = predict(gp, u)
    return log_ndtr(mean[0] / xp.sqrt(variance[0] + xp.exp(2.0 * gp.hyper.log_noise[0])))


def padded_success(gp: GP | None) -> GP | None:
    """The same in arrays of few shapes."""
    return None if gp is None else padded(gp, 1, padded_rows(len(gp.data.u)))
