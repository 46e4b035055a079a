"""Double precision inside the engine, and NumPy's own ways with overflow and the like; the caller's
global settings stay as they were."""

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import jax
import numpy as np

P = ParamSpec("P")
R = TypeVar("R")

NUMPY_DEFAULTS: dict[str, Any] = {
    "divide": "warn",
    "over": "warn",
    "under": "ignore",
    "invalid": "warn",
}


def in_float64(function: Callable[P, R]) -> Callable[P, R]:
    """Run `function` with 64-bit JAX types, and NumPy's default handling of numerical errors.

    Gram matrices of smooth kernels have condition numbers near 1e8, beyond float32. A caller may
    have made NumPy raise where the engine looks at what is not finite by itself.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        with jax.enable_x64(True), np.errstate(**NUMPY_DEFAULTS):
            return function(*args, **kwargs)

    return wrapped
