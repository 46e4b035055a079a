"""What surrogates that rest on Gaussian processes share: their base, and where runs succeed.

The probability that a run succeeds is a factor of the likelihood.
"""

from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any, NamedTuple, Self

import numpy as np

from ..gp.hyperparameters import LENGTH
from ..gp.namespaces import log_ndtr, namespace
from ..gp.optimise import surely_least
from ..gp.process import (
    GP,
    Data,
    Hyper,
    condition,
    coordinates,
    covariance,
    draw,
    fantasize,
    leave_one_out_errors,
    predict,
    resolved,
)
from ..types import LogLikelihood
from .base import RunOutcomes, Surrogate

LENGTHS = (0.1, 0.2, 0.4, 0.8, 1.6)  # of all parameters, among which the evidence chooses
AMPLITUDES = (1.0, 3.0, 10.0)  # of the latent function: up to how sure a place can be
STEPS, TOLERANCE = 50, 1e-6  # of Newton's method; the latent function is of order 1
LEAST_CURVATURE = 1e-6  # of a run's log likelihood, where its label is no surprise at all


class OfProcesses(Surrogate):
    """A surrogate of one process or several, whose last points may be fantasised.

    Attributes:
        gp: The processes.
        log_likelihood: A named tuple of arrays that is called with u [n, d]. Among its fields are
            `success` (see `learn_success`) and `doubt`, the part of the latent variance that
            counts. Its method `second_moment(u, spread)` is log E[L(u)^2] [n] over latent values
            that vary with their variance, or [n, ...] with `spread` [n, ..., k]; `known(u, latent)`
            is the log likelihood [n], were the latent values [k, n].
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

    def realisations(self, rng: np.random.Generator, u: np.ndarray, n: int) -> np.ndarray:
        state = self.log_likelihood
        return np.stack([state.known(u, latent) for latent in draw(state.gp, rng, u, n)])

    def log_success(self, u: np.ndarray) -> np.ndarray:
        return log_success(self.log_likelihood.success, u)


@dataclass(frozen=True, eq=False)
class OfOneProcess(OfProcesses):
    """A surrogate of one process, of a number of each run.

    Attributes:
        gp: The conditioned process.
        values: The numbers that were learned from [n].
        learned_at: Simulations known when the hyperparameters were found.
        success: Where runs succeed, see `learn_success`.
    """

    gp: GP
    values: np.ndarray
    learned_at: int
    success: GP | None = field(default=None, kw_only=True)

    def fantasize(self, u: np.ndarray) -> Self:
        """Condition on the predicted means at u [n, d], for points still being simulated."""
        return replace(self, gp=fantasize(self.gp, u)) if len(u) else self

    def checks(self) -> dict[str, np.ndarray]:
        """Studentised leave-one-out errors `loo_z` [n, 1]."""
        return {"loo_z": leave_one_out_errors(self.gp, len(self.values))}

    def new_target(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new target of the process, its noise included, at u [n, d]: [n], [n]."""
        (mean,), (variance,) = predict(self.gp, u)
        return mean, np.sqrt(variance + np.exp(2.0 * self.gp.hyper.log_noise[0]))


class _Laplace(NamedTuple):
    """Gaussian approximation of the latent function at the runs."""

    log_evidence: float
    targets: np.ndarray  # [p]: as a regression on these, with
    variances: np.ndarray  # [p] of their noise


def learn_success(runs: RunOutcomes, tails: np.ndarray | None) -> GP | None:
    """A process whose normal integral is the probability of success; None if no run failed.

    Probit classification by Laplace's approximation (Rasmussen and Williams 2006, section 3.4),
    which is a regression on working targets: a sharp border is a zero of a smooth function, and
    what fails by chance makes it small.
    """
    if runs.succeeded.all():
        return None
    at, labels = coordinates(runs.u, tails), np.where(runs.succeeded, 1.0, -1.0)
    found = []
    for length, amplitude in product(LENGTHS, AMPLITUDES):
        logs = np.log([length]), np.log([amplitude])
        hyper = Hyper(np.tile(logs[0], (1, at.shape[1])), logs[1], np.zeros(1))
        near = _laplace(covariance(hyper, at, at)[0], labels)
        log_prior = -0.5 * ((logs[0][0] - LENGTH[0]) / LENGTH[1]) ** 2
        found.append((near.log_evidence + log_prior, hyper, near))
    _, hyper, near = max(found, key=lambda one: one[0])
    return condition(hyper, Data(runs.u, near.targets[None], tails, near.variances))


def _laplace(gram: np.ndarray, labels: np.ndarray) -> _Laplace:
    """For the latent function's covariance [p, p] and labels [p] of -1 and 1."""
    latent = np.zeros(len(labels))
    found, following = _newton(gram, labels, latent)
    for _ in range(STEPS):
        if np.abs(following - latent).max() < TOLERANCE:
            break
        latent = following
        found, following = _newton(gram, labels, latent)
    return found


def _newton(
    gram: np.ndarray, labels: np.ndarray, latent: np.ndarray
) -> tuple[_Laplace, np.ndarray]:
    """The approximation around latent values [p], and its mean [p] (algorithm 3.1)."""
    log_density = -0.5 * latent**2 - 0.5 * np.log(2.0 * np.pi)
    slope = labels * np.exp(log_density - log_ndtr(labels * latent))
    curvature = np.maximum(slope**2 + latent * slope, LEAST_CURVATURE)
    root = np.sqrt(curvature)
    factor = np.linalg.cholesky(np.eye(len(gram)) + root[:, None] * gram * root)
    targets = latent + slope / curvature
    white = np.linalg.solve(factor, root * (gram @ (curvature * targets)))
    weights = curvature * targets - root * np.linalg.solve(factor.T, white)
    mean = gram @ weights
    log_evidence = np.sum(log_ndtr(labels * mean)) - 0.5 * weights @ mean
    log_evidence -= np.sum(np.log(np.diag(factor)))
    return _Laplace(float(log_evidence), targets, 1.0 / curvature), mean


def log_success(gp: GP | None, u: Any) -> Any:
    """Log probability [n] that a run at u [n, d] succeeds."""
    xp = namespace(u)
    if gp is None:
        return xp.zeros(len(u))
    mean, variance = predict(gp, u)
    return log_ndtr(mean[0] / xp.sqrt(1.0 + variance[0]))
