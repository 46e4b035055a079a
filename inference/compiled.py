"""Gaussian processes as the surrogates use them: compiled once for both, and grown by belief."""

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from . import gp as processes
from .arguments import checked_points
from .gp import GP

GROWTH = 1.3  # hyperparameters are found anew when data have grown by this factor

condition = jax.jit(processes.condition)
leave_one_out = jax.jit(processes.leave_one_out)
_append_mean = jax.jit(processes.append_mean)
_predict = jax.jit(processes.predict_many)


def predict(gp: GP, u: ArrayLike) -> tuple[jax.Array, jax.Array]:
    """Means and variances [k, n] of the processes at u [n, d].

    Raises:
        ValueError: u is of another shape.
    """
    return _predict(gp, jnp.asarray(checked_points(u, gp.data.u.shape[1])))


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
