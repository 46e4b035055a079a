"""Independent Gaussian processes over the same inputs, on arrays of a fixed shape.

Shapes: k processes; p rows, of which the first `used` are in use; d inputs u in [0, 1].
What is not in use never changes a result (tests), so one compilation serves while data grow.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtri

from .linalg import BLOCK, inverse_cholesky, log_normal_density

TREND_SD = 3.0
"""Prior sd of a trend's coefficient, in units of the targets' sd: broad, yet proper."""
RELEVANT_LENGTH = 0.5  # length scale from which on a parameter's trend fades
JITTER = 1e-7
"""Variance added to every target, in units of the targets': below it rounding would rule."""
SCORE_EDGE = 1e-9  # quantile beyond which normal scores end
MIN_VARIANCE = 1e-10  # latent variance, which rounding may make negative


class Data(NamedTuple):
    u: jax.Array  # [p, d]
    y: jax.Array  # [k, p], standardised; 0 where not in use
    used: jax.Array  # int []
    normal: jax.Array  # bool [d], see `coordinates`


class Hyper(NamedTuple):
    log_length: jax.Array  # [k, d], in units of `coordinates`
    log_amplitude: jax.Array  # [k], in units of y
    log_noise: jax.Array  # [k], sd, in units of y


class GP(NamedTuple):
    """Conditioned processes, ready to predict."""

    hyper: Hyper
    data: Data
    whitener: jax.Array  # [k, p, p], inverse Cholesky factors of the Gram matrices
    weights: jax.Array  # [k, p], inverse Gram matrices times y


def pad(u: np.ndarray, y: np.ndarray, rows: int, normal: np.ndarray | None = None) -> Data:
    """Data u [n, d], y [k, n] in arrays of `rows`; `normal` as in `coordinates`, None for none."""
    extra = rows - len(u)
    return Data(
        jnp.asarray(np.pad(u, ((0, extra), (0, 0)), constant_values=0.5)),
        jnp.asarray(np.pad(y, ((0, 0), (0, extra)))),
        jnp.asarray(len(u)),
        jnp.zeros(u.shape[1], bool) if normal is None else jnp.asarray(normal),
    )


def padded_rows(n: int) -> int:
    """Rows reserved for n points: powers of two from 64."""
    return max(64, 1 << (n - 1).bit_length())


def coordinates(u: jax.Array, normal: jax.Array) -> jax.Array:
    """What the kernel sees of prior quantiles u [n, d]: normal scores where `normal` [d].

    A prior that fades out crowds its tails into the edges of the box: what is smooth in the
    parameter is steep in its quantile there, and no stationary kernel follows. Scores are
    scaled to the quantiles' mean and sd, so that one prior of the length scales serves both.
    """
    scores = 0.5 + ndtri(jnp.clip(u, SCORE_EDGE, 1.0 - SCORE_EDGE)) / jnp.sqrt(12.0)
    return jnp.where(normal, scores, u)


def covariance(hyper: Hyper, a: jax.Array, b: jax.Array) -> jax.Array:
    """Prior covariance [n, m] of one latent function at coordinates a [n, d] and b [m, d].

    Squared exponential plus the trend a_j x_j^2 + b_j x_j + c of Gutmann and Corander
    (JMLR 2016), x = 2a - 1. Its coefficients are integrated out under Gaussians rather
    than estimated with a_j >= 0: that keeps prediction closed-form and carries their
    uncertainty; and a discrepancy over quantiles may saturate, which a_j >= 0 forbids.
    The Gaussians narrow as a parameter's length scale grows, so that what does nothing has no
    trend either; what varies gently is left to the squared exponential in part (at length 1, the
    prior's median, the trend's sds are 0.45 and 0.2 of the full ones). Else what few runs cannot
    exclude of a trend grows towards the edges of the box, and the likelihood, which knows the
    surrogate's uncertainty, shuns them.
    """
    rate = jnp.exp(-hyper.log_length)
    exponent = 2.0 * hyper.log_amplitude
    for j in range(a.shape[1]):  # a loop, so that the last axis is long and vectorised
        exponent = exponent - 0.5 * (rate[j] * (a[:, j, None] - b[None, :, j])) ** 2
    return jnp.exp(exponent) + TREND_SD**2 * trend(hyper, a) @ trend(hyper, b).T


def trend(hyper: Hyper, a: jax.Array) -> jax.Array:
    """Basis 1, r_j x_j, (r_j x_j)^2 at x = 2a - 1: [n, d] -> [n, 1 + 2d].

    The relevance r_j is 1 at short lengths and falls with long ones l_j as the slope of the
    squared exponential does, 1 / l_j.
    """
    relevance = 1.0 / jnp.sqrt(1.0 + (jnp.exp(hyper.log_length) / RELEVANT_LENGTH) ** 2)
    x = relevance * (2.0 * a - 1.0)
    return jnp.concatenate([jnp.ones((x.shape[0], 1)), x, x**2], axis=1)


def gram_rows(hyper: Hyper, data: Data, start: jax.Array) -> jax.Array:
    """Covariance [BLOCK, p] of one process's targets from row `start` on; rows not in use are
    those of the identity."""
    rows = jnp.arange(data.u.shape[0])
    here = start + rows[:BLOCK]
    at = coordinates(data.u, data.normal)
    smooth = covariance(hyper, jax.lax.dynamic_slice_in_dim(at, start, BLOCK), at)
    both = (here < data.used)[:, None] & (rows < data.used)
    noise = jnp.where(here < data.used, jnp.exp(2.0 * hyper.log_noise) + JITTER, 1.0)
    return jnp.where(both, smooth, 0.0) + jnp.where(here[:, None] == rows, noise[:, None], 0.0)


def untaught(hyper: Hyper, data: Data) -> GP:
    """Processes that have seen none of the data yet."""
    k, p = data.y.shape
    return GP(hyper, data, jnp.tile(jnp.eye(p), (k, 1, 1)), jnp.zeros((k, p)))


def grow(gp: GP, data: Data, known: jax.Array | int) -> GP:
    """`gp` given data of which it has seen the first `known` rows already.

    Explicit inverse factors make prediction a product.
    """

    def one(process: tuple[Hyper, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        hyper, whitener, y = process
        rows = partial(gram_rows, hyper, data)
        whitener = inverse_cholesky(rows, data.used, whitener, known)
        return whitener, (whitener @ y) @ whitener

    return GP(gp.hyper, data, *jax.lax.map(one, (gp.hyper, gp.whitener, data.y)))


def _cross(gp: GP, u: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Covariance [k, m, p] of the latent functions at u [m, d] and at the data; the variance
    [k, m] at u alone."""
    used = jnp.arange(gp.data.u.shape[0]) < gp.data.used
    at, there = (coordinates(points, gp.data.normal) for points in (u, gp.data.u))
    cross = jax.vmap(covariance, (0, None, None))(gp.hyper, at, there) * used
    trends = TREND_SD**2 * jnp.sum(jax.vmap(trend, (0, None))(gp.hyper, at) ** 2, -1)
    return cross, jnp.exp(2.0 * gp.hyper.log_amplitude)[:, None] + trends


def predict(gp: GP, u: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Means and variances [k] of the latent functions (without noise) at u [d]."""
    mean, variance = predict_many(gp, u[None])
    return mean[:, 0], variance[:, 0]


def predict_many(gp: GP, u: jax.Array) -> tuple[jax.Array, jax.Array]:
    """`predict` at u [m, d]: [k, m] each."""
    cross, alone = _cross(gp, u)
    mean = jnp.einsum("kp,kmp->km", gp.weights, cross)
    explained = jnp.sum(_whitened(gp, cross) ** 2, axis=2)
    return mean, jnp.maximum(alone - explained, MIN_VARIANCE)


def _whitened(gp: GP, cross: jax.Array) -> jax.Array:
    return cross @ jnp.swapaxes(gp.whitener, 1, 2)


def predict_joint(gp: GP, u: jax.Array, v: jax.Array) -> jax.Array:
    """Posterior covariance [k, m, q] of the latent functions between u [m, d] and v [q, d]."""
    at_u, at_v = _whitened(gp, _cross(gp, u)[0]), _whitened(gp, _cross(gp, v)[0])
    at, there = (coordinates(points, gp.data.normal) for points in (u, v))
    prior = jax.vmap(covariance, (0, None, None))(gp.hyper, at, there)
    return prior - at_u @ jnp.swapaxes(at_v, 1, 2)


def log_marginal_likelihood(hyper: Hyper, data: Data, wanted: jax.Array | None = None) -> jax.Array:
    """log p(y | hyper) [k], trend integrated out (Rasmussen and Williams 2006, eq. 2.30).

    Args:
        wanted: bool [k]; of the others, which cost next to nothing, a constant is returned.
    """
    wanted = jnp.ones(len(data.y), bool) if wanted is None else wanted

    def one(process: tuple[Hyper, jax.Array, jax.Array]) -> jax.Array:
        hyper, y, wanted = process
        constants = data._replace(y=y)

        def density(hyper: Hyper) -> jax.Array:
            return log_normal_density(gram_rows, hyper, constants, y, data.used)

        return jax.lax.cond(wanted, density, lambda _: jnp.zeros(()), hyper)

    values = jax.lax.map(one, (hyper, data.y, wanted))
    return values - 0.5 * data.used * jnp.log(2.0 * jnp.pi)


def leave_one_out(gp: GP) -> tuple[jax.Array, jax.Array]:
    """Mean and variance [k, p] of each y given all others (Rasmussen and Williams, eq. 5.12).

    The variance includes the noise; rows not in use are meaningless.
    """
    variance = 1.0 / jnp.sum(gp.whitener**2, axis=1)
    return gp.data.y - gp.weights * variance, variance
