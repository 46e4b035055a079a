"""Base of surrogates that rest on Gaussian processes."""

from typing import Any

import numpy as np

from ..gp.optimise import surely_least
from ..gp.process import GP, resolved
from ..types import LogLikelihood
from .base import Surrogate
from .success import log_success


class OfProcesses(Surrogate):
    """A surrogate of one process or several, whose last points may be fantasised.

    Attributes:
        gp: The processes.
        log_likelihood: A named tuple of arrays that is called with u [n, d]. Among its fields are
            `success` (see `learn_success`) and `doubt`, the part of the latent variance that
            counts. Its method `second_moment(u, spread)` is log E[L(u)^2] [n] over latent values
            that vary with their variance, or [n, ...] with `spread` [n, ..., k].
    """

    gp: GP
    log_likelihood: Any

    @property
    def u(self) -> np.ndarray:  # pyright: ignore  nobody sets it
        return self.gp.data.u

    @property
    def sure(self) -> LogLikelihood:
        return self.log_likelihood._replace(doubt=np.zeros(()))

    def best(self) -> np.ndarray:
        return surely_least(self.gp)

    def log_second_moment(self, u: np.ndarray, runs: np.ndarray | None = None) -> np.ndarray:
        spread = None if runs is None else resolved(self.gp, u, runs)
        return self.log_likelihood.second_moment(u, spread)

    def log_success(self, u: np.ndarray) -> np.ndarray:
        return log_success(self.log_likelihood.success, u)
