"""Where runs succeed: the probability of it is a factor of the likelihood."""

from typing import Any

import numpy as np

from ..gp.hyperparameters import maximum_a_posteriori
from ..gp.namespaces import log_ndtr, namespace
from ..gp.process import GP, Data, condition, padded, padded_rows, predict
from .feasibility import Feasibility


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
