"""Gaussian processes as the surrogates use them: compiled once for both, and grown by belief."""

import jax
import jax.numpy as jnp
import numpy as np

from . import gp as processes
from .gp import GP

GROWTH = 1.3  # hyperparameters are found anew when data have grown by this factor

condition = jax.jit(processes.condition)
leave_one_out = jax.jit(processes.leave_one_out)
predict = jax.jit(processes.predict_many)
_append_mean = jax.jit(processes.append_mean)


def believe(gp: GP, u: np.ndarray) -> GP:
    """The processes after their own predictions at u [n, d] came true.

    Raises:
        ValueError: more rows than are reserved.
    """
    n, (rows, dimension) = int(gp.data.used), gp.data.u.shape
    if n + len(u) > rows:
        raise ValueError(f"{n} simulations and {len(u)} pending ones exceed the {rows} reserved")
    # one shape, whatever the number of points
    padded = np.concatenate([u, np.full((rows - len(u), dimension), 0.5)])
    return _append_mean(gp, jnp.asarray(padded), jnp.asarray(len(u)))
