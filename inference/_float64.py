"""Double precision and one thread of BLAS inside the engine, and NumPy's own ways with overflow and
the like; the caller's global settings stay as they were."""

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import jax
import numpy as np
from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")

NUMPY_DEFAULTS: dict[str, Any] = {
    "divide": "warn",
    "over": "warn",
    "under": "ignore",
    "invalid": "warn",
}


def in_float64(function: Callable[P, R]) -> Callable[P, R]:
    """Run `function` with 64-bit JAX types, one thread of BLAS, and NumPy's default handling of
    numerical errors.

    Gram matrices of smooth kernels have condition numbers near 1e8, beyond float32. Of a few
    hundred rows, they are factored faster by one thread than by several, which wait for each
    other: a criticism beside another process took 260 s by two threads and 35 s by one. It also
    gives the same bits on every number of processors. A caller may have made NumPy raise where the
    engine looks at what is not finite by itself.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        one_thread = _thread_pools().limit(limits=1, user_api="blas")
        with jax.enable_x64(True), np.errstate(**NUMPY_DEFAULTS), one_thread:
            return function(*args, **kwargs)

    return wrapped


@functools.cache
def _thread_pools() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401  its BLAS is another than NumPy's, and known once it is loaded

    return ThreadpoolController()
