"""Acquisition rules: where to simulate next."""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ._float64 import in_float64
from .gp import GP, predict
from .optimise import minimise_in_box
from .surrogate import DiscrepancySurrogate


class LCBState(NamedTuple):
    """What the bound depends on."""

    gp: GP
    width: jax.Array  # []


def exploration_width(t: int, dimension: int, epsilon: float = 0.1) -> float:
    """eta_t, eta_t^2 = 2 log(t^(d/2 + 2) pi^2 / (3 epsilon)) (Gutmann and Corander 2016).

    Args:
        t: Simulations so far, at least 1.
        dimension: d.
        epsilon: eps_eta, 0.1 in the paper.
    """
    return float(np.sqrt(2.0 * np.log(t ** (dimension / 2 + 2) * np.pi**2 / (3.0 * epsilon))))


def lower_confidence_bound(state: LCBState, u: jax.Array) -> jax.Array:
    """mu - eta sqrt(v) at u [d], v the variance of the latent mean (without noise)."""
    mean, variance = predict(state.gp, u)
    return mean - state.width * jnp.sqrt(variance)


@dataclass(frozen=True)
class LowerConfidenceBound:
    """Minimise mu - eta_t sqrt(v), then jitter (Gutmann and Corander 2016, stochastic rule).

    The jitter, a Gaussian truncated to the box, keeps points off the bounds, where the
    variance attracts the minimiser, and makes the points of a batch differ.

    Attributes:
        jitter: Its standard deviation, in prior quantiles. Of 0.03, 0.05 and 0.1 the second
            gave the best posteriors on three toys; 0.03 puts half as many points again
            within 2 % of a bound.
    """

    jitter: float = 0.05

    def __post_init__(self) -> None:
        if not self.jitter > 0:
            raise ValueError(f"jitter must be positive, got {self.jitter}")

    @in_float64
    def __call__(self, key: jax.Array, surrogate: DiscrepancySurrogate, n: int) -> np.ndarray:
        """n points u [n, d]; each is believed before the next is chosen."""
        points = []
        for subkey in jax.random.split(key, n):
            dimension = surrogate.gp.data.u.shape[1]
            width = jnp.asarray(exploration_width(surrogate.count, dimension))
            centre = minimise_in_box(
                lower_confidence_bound, LCBState(surrogate.gp, width), dimension
            )
            points.append(truncated_normal(subkey, centre, self.jitter))
            surrogate = surrogate.believe(points[-1][None])
        return np.stack(points)


def truncated_normal(key: jax.Array, centre: np.ndarray, sd: float) -> np.ndarray:
    """Gaussian around `centre` [d], truncated to the unit box."""
    low, high = -centre / sd, (1.0 - centre) / sd
    z = jax.random.truncated_normal(key, low, high, centre.shape)
    return np.clip(centre + sd * np.asarray(z), 1e-9, 1.0 - 1e-9)


RULES = {"lcb": LowerConfidenceBound}
"""Acquisitions by the name users give."""
