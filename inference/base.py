"""Protocols at the engine's borders; the consumer owns them."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import jax
import numpy as np

Theta = Mapping[str, np.ndarray]
"""Parameter name -> values in natural units; all of shape [n], or all scalars."""

LogLikelihood = Callable[[Any, jax.Array], jax.Array]
"""(state, u [d]) -> scalar. A module-level function, so that what it compiles to is cached."""

LogSecondMoment = Callable[[Any, jax.Array, Any], jax.Array]
"""(state, u [d], spread [k] or None) -> scalar; see `acquisition`."""


class Simulator(Protocol):
    """Anything that turns parameters into signals, one row per seed."""

    def __call__(self, theta: dict[str, np.ndarray], seeds: np.ndarray, /) -> np.ndarray:
        """theta: name -> [n]; seeds: int64 [n]  ->  signals [n, *signal_shape]."""
        ...


class Discrepancy(Protocol):
    """A distance between the observed and one simulated signal; non-finite means failed."""

    def __call__(self, observed: np.ndarray, simulated: np.ndarray, /) -> float: ...


class Surrogate(Protocol):
    """What was learned from the simulations, over prior quantiles u in [0, 1]^d."""

    @property
    def state(self) -> Any:
        """Pytree of arrays on which `log_likelihood` depends; data, never a closure."""
        ...

    @property
    def log_likelihood(self) -> LogLikelihood: ...

    def minimum(self) -> np.ndarray:
        """The u [d] that fits best."""
        ...

    def believe(self, u: np.ndarray) -> "Surrogate":
        """The surrogate after its own predictions at u [n, d] came true (pending points)."""
        ...

    def constants(self) -> dict[str, np.ndarray]:
        """What was fixed before sampling; kept with the results."""
        ...

    def checks(self) -> dict[str, np.ndarray]:
        """The emulator's checks, the first axis of each the simulation; `loo_z` [n, k] are
        studentised leave-one-out errors."""
        ...

    def warnings(self) -> list[str]:
        """What the checks complain of, in sentences."""
        ...

    def predictive(self, key: jax.Array, u: np.ndarray) -> dict[str, np.ndarray]:
        """One draw of what a simulation gives for each row of u [n, d]: name -> [n, ...]."""
        ...


class Acquisition(Protocol):
    """Where to simulate next."""

    def __call__(self, key: jax.Array, surrogate: Any, n: int, /) -> np.ndarray:
        """n different points u [n, d]; `surrogate` already believes what is pending."""
        ...
