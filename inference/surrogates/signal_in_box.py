"""A fitted signal that is believed only in a box about where it fits best."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._float64 import in_float64
from ..gp.optimise import minimise_in_box
from ..types import LogLikelihood
from .signal import SignalSurrogate
from .signal_likelihood import SignalState, log_likelihood

WALL = 0.01  # of prior quantiles, beyond a box, over which the likelihood vanishes


class BoxedState(NamedTuple):
    """What the likelihood depends on, and the box."""

    signal: SignalState
    low: jax.Array
    high: jax.Array


@dataclass(frozen=True, eq=False, kw_only=True)
class SignalInBox(SignalSurrogate):
    """Its likelihood vanishes outside of a box.

    Far from where it fits best hardly anything was simulated. There the emulator knows least, and
    what it does not know counts as noise that explains anything.

    Attributes:
        low, high: Ends of the box in prior quantiles [d].
    """

    low: np.ndarray
    high: np.ndarray

    @property
    @in_float64
    def state(self) -> BoxedState:
        return BoxedState(self.signal_state, jnp.asarray(self.low), jnp.asarray(self.high))

    @property
    def log_likelihood(self) -> LogLikelihood:
        return log_likelihood_in_box

    @in_float64
    def minimum(self) -> np.ndarray:
        return minimise_in_box(_negative, self.state, len(self.low), self.low, self.high)


def believed_in(surrogate: SignalSurrogate, low: np.ndarray, high: np.ndarray) -> SignalInBox:
    """The same, believed in a box only."""
    kept = {field.name: getattr(surrogate, field.name) for field in fields(surrogate)}
    return SignalInBox(**kept, low=low, high=high)


def log_likelihood_in_box(boxed: BoxedState, u: jax.Array) -> jax.Array:
    """The likelihood with Gaussian walls about the box, which gradients can climb."""
    outside = jnp.maximum(boxed.low - u, 0.0) + jnp.maximum(u - boxed.high, 0.0)
    return log_likelihood(boxed.signal, u) - 0.5 * jnp.sum((outside / WALL) ** 2)


def _negative(boxed: BoxedState, u: jax.Array) -> jax.Array:
    return -log_likelihood_in_box(boxed, u)
