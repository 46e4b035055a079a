"""How the size of run-to-run noise depends on the parameters."""

from typing import Any, NamedTuple

import numpy as np

from ...gp.hyperparameters import maximum_a_posteriori
from ...gp.namespaces import namespace
from ...gp.process import (
    GP,
    Data,
    Hyper,
    condition,
    leave_one_out,
    predict_mean,
)

NEEDED_NATS = 12.0  # log predictive density that a size by parameters must gain over a constant one
EQUAL_RUNS_TOLERANCE = 1e-9  # relative difference up to which two runs count as equal
FIXED = np.log(0.7), 0.0, np.log(0.7)  # length, amplitude and noise of the process that asks first


class Size(NamedTuple):
    """Log of the noise's size at u: a process's mean, within what was found at the runs."""

    gp: GP
    low: np.ndarray  # []
    high: np.ndarray  # []


def log_size(size: Size, u: Any) -> Any:
    """[n] at u [n, d]."""
    return namespace(u).clip(predict_mean(size.gp, u)[0], size.low, size.high)


def run_spread(size: Size | None, u: np.ndarray) -> np.ndarray | None:
    """The noise's variance at u [n, d] over that of the size 1, [n]."""
    return None if size is None else np.exp(2.0 * log_size(size, u))


def learn_size(log_sizes: np.ndarray, u: np.ndarray, normal: np.ndarray | None) -> Size | None:
    """The size as a smooth function of the parameters; None where a constant predicts as well.

    What predicts a run's size must do so where the run is left out. A process of fixed
    hyperparameters is asked first: where the size is constant, nothing is optimised.

    Args:
        log_sizes: Of the noise of each run [n], with an error of their own.
        u: Prior quantiles [n, d].
        normal: As of `Data`.
    """
    n, d = u.shape
    centre, sd = log_sizes.mean(), log_sizes.std()
    if not sd > 0.0:
        return None
    data = Data(u, ((log_sizes - centre) / sd)[None], normal)
    length, amplitude, noise = FIXED
    fixed = Hyper(np.full((1, d), length), np.array([amplitude]), np.array([noise]))
    if _gain(condition(fixed, data)) < NEEDED_NATS:
        return None
    gp = condition(maximum_a_posteriori(data), data)
    if _gain(gp) < NEEDED_NATS:
        return None
    gp = gp._replace(weights=gp.weights * sd)
    found = predict_mean(gp, u)[0]
    return Size(gp, found.min(), found.max())


def _gain(gp: GP) -> float:
    """Log predictive density that the parameters gain where each run is left out, over the mean of
    all others; Gaussian errors of the best sd."""
    n, y = len(gp.data.u), gp.data.y
    error = y - leave_one_out(gp)[0]
    from_mean = (y - y.mean()) * n / (n - 1)
    return 0.5 * n * float(np.log(np.sum(from_mean**2) / np.sum(error**2)))
