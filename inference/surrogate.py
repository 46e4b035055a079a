"""The paper's surrogate: a Gaussian process on the (transformed) discrepancy."""

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ._float64 import in_float64
from .base import LogLikelihood
from .gp import GP, Data, condition, leave_one_out, pad, padded_rows, predict
from .hyper import maximum_a_posteriori
from .likelihood import Threshold, ThresholdState, choose_threshold, log_likelihood
from .optimise import minimise_in_box
from .transform import Transform, candidates

_condition = jax.jit(condition)
_leave_one_out = jax.jit(leave_one_out)
_predict = jax.jit(jax.vmap(predict, in_axes=(None, 0)))


@dataclass(frozen=True)
class DiscrepancySurrogate:
    """GP of g(Delta) over prior quantiles, g = `transform`; see `learn`.

    Attributes:
        gp: The conditioned process, on targets standardised by `location` and `scale`.
        count: Rows of the process in use.
        location: Mean of g(Delta).
        scale: Standard deviation of g(Delta).
        transform: g.
        threshold: eps on the scale of g(Delta).
        score: Leave-one-out log predictive density of Delta, summed.
    """

    gp: GP
    count: int
    location: float
    scale: float
    transform: Transform
    threshold: float
    score: float

    @property
    def state(self) -> ThresholdState:
        return ThresholdState(self.gp, jnp.asarray((self.threshold - self.location) / self.scale))

    @property
    def log_likelihood(self) -> LogLikelihood:
        return log_likelihood

    @in_float64
    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new g(Delta), its noise included, at quantiles u [n, d]: [n], [n]."""
        mean, variance = _predict(self.gp, jnp.asarray(u, float))
        sd = np.sqrt(np.asarray(variance) + np.exp(2.0 * float(self.gp.hyper.log_noise)))
        return self.location + self.scale * np.asarray(mean), self.scale * sd

    @in_float64
    def minimum(self) -> np.ndarray:
        """Minimiser of the mean over the box, u [d]."""
        return minimise_in_box(_mean, self.gp, self.gp.data.u.shape[1])

    @in_float64
    def believe(self, u: np.ndarray) -> "DiscrepancySurrogate":
        """Condition on the predicted means at u [n, d]: the mean stays, the variance shrinks.

        The kriging believer of Ginsbourger et al. (2010), for points still being simulated.
        """
        if len(u) == 0:
            return self
        mean, _ = _predict(self.gp, jnp.asarray(u))
        n = self.count
        points = np.concatenate([np.asarray(self.gp.data.u)[:n], u])
        targets = np.concatenate([np.asarray(self.gp.data.y)[:n], np.asarray(mean)])
        rows = max(padded_rows(len(targets)), len(self.gp.data.y))
        gp = _condition(self.gp.hyper, pad(points, targets, rows))
        return replace(self, gp=gp, count=len(targets))

    def constants(self) -> dict[str, np.ndarray]:
        """What was fixed before sampling."""
        return {
            "threshold": np.asarray(self.threshold),
            "transform": np.asarray(self.transform.name),
        }

    @in_float64
    def checks(self) -> dict[str, np.ndarray]:
        """`loo_z` [n, 1]: leave-one-out errors over their predicted sd."""
        mean, variance = (np.asarray(m)[: self.count] for m in _leave_one_out(self.gp))
        residual = np.asarray(self.gp.data.y)[: self.count] - mean
        return {"loo_z": (residual / np.sqrt(variance))[:, None]}

    def warnings(self) -> list[str]:
        return []

    def predictive(self, key: jax.Array, u: np.ndarray) -> dict[str, np.ndarray]:
        """A new discrepancy at each u [n, d]: `discrepancy` [n]."""
        mean, sd = self.predict(u)
        drawn = mean + sd * np.asarray(jax.random.normal(key, mean.shape))
        inverse = {
            "identity": lambda x: x,
            "sqrt": lambda x: np.maximum(x, 0.0) ** 2,
            "log": np.exp,
        }
        return {"discrepancy": inverse[self.transform.name](drawn) - self.transform.offset}


def _mean(gp: GP, u: jax.Array) -> jax.Array:
    return predict(gp, u)[0]


@in_float64
def learn(
    u: np.ndarray,
    discrepancy: np.ndarray,
    transform: str | None = None,
    threshold: Threshold = None,
) -> DiscrepancySurrogate:
    """Fit the surrogate.

    Of the transforms identity, sqrt and log the one with the highest leave-one-out log
    predictive density of the discrepancy itself (Jacobian included) is taken, unless given.

    Args:
        u: Prior quantiles [n, d].
        discrepancy: Finite values [n], n >= 2.
        transform: A name, or None to choose.
        threshold: See `likelihood.choose_threshold`.

    Raises:
        ValueError: bad transform or threshold.
    """
    fits = [_fit(u, discrepancy, option) for option in candidates(transform, discrepancy)]
    best = max(fits, key=lambda fitted: fitted.score)
    lowest = float(best.predict(best.minimum()[None])[0][0])
    return replace(best, threshold=choose_threshold(threshold, discrepancy, best.transform, lowest))


def _fit(u: np.ndarray, discrepancy: np.ndarray, transform: Transform) -> DiscrepancySurrogate:
    values = transform(discrepancy)
    location, spread = float(values.mean()), float(values.std())
    scale = spread if spread > 0 else 1.0  # all equal: nothing to standardise
    data = pad(u, (values - location) / scale, padded_rows(len(values)))
    gp = _condition(maximum_a_posteriori(data), data)
    score = _score(gp, data, len(values)) + float(
        np.sum(transform.log_jacobian(discrepancy) - np.log(scale))
    )
    return DiscrepancySurrogate(gp, len(values), location, scale, transform, np.nan, score)


def _score(gp: GP, data: Data, n: int) -> float:
    """Leave-one-out log predictive density of the standardised targets, summed."""
    mean, variance = (np.asarray(moment)[:n] for moment in _leave_one_out(gp))
    residual = np.asarray(data.y)[:n] - mean
    return float(-0.5 * np.sum(residual**2 / variance + np.log(2.0 * np.pi * variance)))


FAMILIES: dict[str, Any] = {"discrepancy": learn}
"""Surrogates by the name users give."""
