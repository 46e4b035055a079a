"""Double precision and one thread of BLAS inside the engine, and NumPy's own ways with overflow and
the like; the caller's global settings stay as they were."""

import functools
from collections.abc import Callable
from threading import Lock
from typing import Any

import jax
import numpy as np
from threadpoolctl import OpenBLASController, ThreadpoolController

NUMPY_DEFAULTS: dict[str, Any] = {
    "divide": "warn",
    "over": "warn",
    "under": "ignore",
    "invalid": "warn",
}


def in_float64[**P, R](function: Callable[P, R]) -> Callable[P, R]:
    """Run `function` with 64-bit JAX types, one thread of BLAS, and the default handling of
    numerical errors by NumPy and JAX.

    Gram matrices of smooth kernels have condition numbers near 1e8, beyond float32. Of a few
    hundred rows, they are factored faster by one thread than by several, which wait for each
    other: a criticism beside another process took 260 s by two threads and 35 s by one. BLAS also
    gives the same bits then, however many processors there are. The number of its threads belongs
    to the whole process: other Python threads have one, too, while the engine computes. A caller
    may have made NumPy or JAX raise where the engine looks at what is not finite by itself, and JAX
    stricter about shapes and types than it and NumPyro are.

    It stands where users enter the engine, not on what these functions call.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        with (
            jax.enable_x64(True),
            jax.numpy_rank_promotion("allow"),
            jax.numpy_dtype_promotion("standard"),
            jax.debug_nans(False),
            jax.debug_infs(False),
            np.errstate(**NUMPY_DEFAULTS),
            _one_blas_thread,
        ):
            return function(*args, **kwargs)

    return wrapped


class _OneBlasThread:
    """Limits BLAS to one thread from the first Python thread that enters to the last that leaves.

    threadpoolctl alone restores what each thread has found, which may be the limit of another, and
    lets only the thread that limited OpenBLAS change it back.
    """

    def __init__(self):
        self._lock, self._inside = Lock(), 0

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                OpenBLASController.clear_controlling_thread(force=True)
                self._limit = _blas().limit(limits=1)
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                OpenBLASController.clear_controlling_thread(force=True)
                self._limit.restore_original_limits()
                OpenBLASController.clear_controlling_thread()


_one_blas_thread = _OneBlasThread()


@functools.cache
def _blas() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401  its BLAS is another than NumPy's, and known once it is loaded

    return ThreadpoolController().select(user_api="blas")
