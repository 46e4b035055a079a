"""What surrogates share that rest on Gaussian processes."""

from typing import Any, Protocol

import numpy as np

from ..gp.optimise import surely_least
from ..gp.process import GP, resolved
from .base import Surrogate
from .success import log_success


class ProcessLikelihood(Protocol):
    """A named tuple of arrays, among them `doubt`, the part of the latent variance that counts."""

    @property
    def success(self) -> GP | None:
        """Where runs succeed, see `success.learn_success`; None is everywhere."""
        ...

    def __call__(self, u: Any, /) -> Any:
        """Log likelihood [n] at u [n, d]."""
        ...

    def second_moment(self, u: np.ndarray, spread: np.ndarray | None) -> np.ndarray:
        """log E[L(u)^2] [n], over a latent mean that varies with the processes' variance; or
        [n, ...] with the variance `spread` [n, ..., k]."""
        ...

    def _replace(self, **parts: Any) -> "ProcessLikelihood": ...


class OfProcesses(Surrogate):
    """A surrogate of one process or several, whose last points may be fantasised."""

    @property
    def gp(self) -> GP:
        """The processes."""
        raise NotImplementedError

    @property
    def log_likelihood(self) -> ProcessLikelihood:  # pyright: ignore  nobody sets it
        raise NotImplementedError

    @property
    def u(self) -> np.ndarray:  # pyright: ignore  nobody sets it
        return self.gp.data.u

    @property
    def sure(self) -> ProcessLikelihood:
        return self.log_likelihood._replace(doubt=np.zeros(()))

    def best(self) -> np.ndarray:
        return surely_least(self.gp)

    def log_second_moment(self, u: np.ndarray, runs: np.ndarray | None = None) -> np.ndarray:
        spread = None if runs is None else resolved(self.gp, u, runs)
        return self.log_likelihood.second_moment(u, spread)

    def log_success(self, u: np.ndarray) -> np.ndarray:
        return log_success(self.log_likelihood.success, u)
