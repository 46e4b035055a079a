"""Gaussian processes as the surrogates use them: compiled, and grown by data and by belief."""

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from ..arguments import checked_points
from . import process as processes
from .process import GP, Data, Hyper

GROWTH = 1.3  # hyperparameters are found anew when data have grown by this factor

leave_one_out = jax.jit(processes.leave_one_out)
_grow = jax.jit(processes.grow)
_predict = jax.jit(processes.predict_many)


def condition(hyper: Hyper, data: Data) -> GP:
    """The processes given the data."""
    return _grow(processes.untaught(hyper, data), data, jnp.asarray(0))


def extend(gp: GP, data: Data) -> GP:
    """The processes given `data`; quick where what they have seen comes first in it."""
    n = int(gp.data.used)
    before, now = np.asarray(gp.data.u), np.asarray(data.u)
    more = before.shape == now.shape and int(data.used) >= n
    if more and np.array_equal(before[:n], now[:n]):
        return _grow(gp, data, jnp.asarray(n))
    return condition(gp.hyper, data)


def predict(gp: GP, u: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Means and variances [k, n] of the latent functions at u [n, d].

    In batches as long as the data's arrays, so that one shape is compiled.

    Raises:
        ValueError: u is of another shape.
    """
    rows, d = gp.data.u.shape
    points, parts = checked_points(u, d), []
    for start in range(0, max(len(points), 1), rows):
        batch = points[start : start + rows]
        padded = np.concatenate([batch, np.full((rows - len(batch), d), 0.5)])
        mean, variance = _predict(gp, jnp.asarray(padded))
        parts.append(np.asarray([mean, variance])[:, :, : len(batch)])
    mean, variance = np.concatenate(parts, axis=2)
    return mean, variance


def believe(gp: GP, u: np.ndarray) -> GP:
    """The processes after their own predictions at u [n, d] came true.

    The kriging believer of Ginsbourger et al. (2010): the mean stays, the variance shrinks.

    Raises:
        ValueError: more rows than are reserved.
    """
    n, rows = int(gp.data.used), gp.data.u.shape[0]
    if n + len(u) > rows:
        raise ValueError(f"{n} simulations and {len(u)} pending ones exceed the {rows} reserved")
    points, targets = np.array(gp.data.u), np.array(gp.data.y)
    new = slice(n, n + len(u))
    points[new], targets[:, new] = u, predict(gp, u)[0]
    data = gp.data._replace(
        u=jnp.asarray(points), y=jnp.asarray(targets), used=jnp.asarray(n + len(u))
    )
    return _grow(gp, data, jnp.asarray(n))
