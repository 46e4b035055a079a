"""A fitted signal that is believed only near where it fits best."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._float64 import in_float64
from ..gp.optimise import minimise_in_box
from ..surrogates.signal import SignalSurrogate
from ..surrogates.signal_likelihood import SignalState, log_likelihood
from ..types import LogLikelihood
from .prior_boxes import Box

WALL = 0.01  # of prior quantiles, beyond a box, over which the likelihood vanishes


class NearState(NamedTuple):
    """What the likelihood depends on, and the box."""

    signal: SignalState
    low: jax.Array
    high: jax.Array


@dataclass(frozen=True, eq=False, kw_only=True)
class NearSignal(SignalSurrogate):
    """Its likelihood vanishes outside of a box.

    Far from where it fits best hardly anything was simulated. There the emulator knows least, and
    what it does not know counts as noise that explains anything.
    """

    box: Box

    @property
    @in_float64
    def state(self) -> NearState:
        return NearState(self.signal_state, *map(jnp.asarray, self.box))

    @property
    def log_likelihood(self) -> LogLikelihood:
        return log_likelihood_near

    @in_float64
    def minimum(self) -> np.ndarray:
        return minimise_in_box(_negative, self.state, len(self.box.low), *self.box)


def believed_in(surrogate: SignalSurrogate, box: Box) -> NearSignal:
    """The same, believed in a box only."""
    kept = {field.name: getattr(surrogate, field.name) for field in fields(surrogate)}
    return NearSignal(**kept, box=box)


def log_likelihood_near(near: NearState, u: jax.Array) -> jax.Array:
    """The likelihood with Gaussian walls about the box, which gradients can climb."""
    outside = jnp.maximum(near.low - u, 0.0) + jnp.maximum(u - near.high, 0.0)
    return log_likelihood(near.signal, u) - 0.5 * jnp.sum((outside / WALL) ** 2)


def _negative(near: NearState, u: jax.Array) -> jax.Array:
    return -log_likelihood_near(near, u)
