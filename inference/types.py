"""Types that every room of the engine shares. Loads nothing but NumPy, for workers import it."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

Theta = Mapping[str, np.ndarray]
"""Parameter name -> values in natural units; all of shape [n], or all scalars."""

LogLikelihood = Callable[[Any], Any]
"""u [n, d] -> [n], for arrays of NumPy, and of JAX where NUTS is to follow it (see
`gp.namespaces`). As a named tuple of arrays it is data: what NUTS compiles for one serves all of
equal shapes, see `nuts.padded`."""


class Simulator(Protocol):
    """Anything that turns parameters into signals, one row per seed."""

    def __call__(self, theta: dict[str, np.ndarray], seeds: np.ndarray, /) -> np.ndarray:
        """theta: name -> [n]; seeds: int64 [n]  ->  signals [n, *signal_shape]."""
        ...


class SingleSimulator(Protocol):
    """Anything that turns one set of parameters into one signal."""

    def __call__(self, theta: dict[str, float], seed: int, /) -> np.ndarray:
        """theta: name -> value; seed in [0, 2^31)  ->  signal [*signal_shape]."""
        ...


class Discrepancy(Protocol):
    """A distance between the observed and one simulated signal; non-finite means failed."""

    def __call__(self, observed: np.ndarray, simulated: np.ndarray, /) -> float: ...
