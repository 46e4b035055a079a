"""A mixture of Student t distributions, fitted to weighted points and proposing more.

Over x = Phi^-1(u), in which the prior is standard normal. One component is the prior itself,
so that no region of the prior is ever out of reach, and ratios to the posterior are bounded.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

COMPONENTS = 8
DEGREES_OF_FREEDOM = 6  # even: tails heavier than a posterior's, at little cost near it
PRIOR_SHARE = 0.05
EVEN_SHARE = 0.2  # share of the proposals spread evenly over the components, for small modes
RESAMPLED_POINTS = 512
EM_STEPS = 8  # of expectation maximisation
UNIFORMS = DEGREES_OF_FREEDOM // 2 + 2
"""Numbers, besides d normals, that make one draw."""


class Mixture(NamedTuple):
    """k components, each half at its own width and half at `sharpness` times that."""

    log_share: jax.Array  # [k]
    mean: jax.Array  # [k, d]
    factor: jax.Array  # [k, d, d], lower triangular
    whitener: jax.Array  # [k, d, d], inverse of factor
    sharpness: jax.Array  # [], in (0, 1]


def log_density(mixture: Mixture, x: jax.Array) -> jax.Array:
    """Log density at x [n, d]: [n]."""
    square, volume = _distances(mixture, x)
    wide = _log_student(square, x.shape[-1])
    sharp = _log_student(square / mixture.sharpness**2, x.shape[-1])
    sharp = sharp - x.shape[-1] * jnp.log(mixture.sharpness)
    components = jnp.logaddexp(wide, sharp) - math.log(2.0) + volume
    # one column more for the prior: one sum of exponentials is quicker to compile than two
    shares = math.log1p(-PRIOR_SHARE) + mixture.log_share + components
    prior = math.log(PRIOR_SHARE) + log_prior(x)[:, None]
    return log_sum_exp(jnp.concatenate([shares, prior], axis=-1))


def to_unit(x: jax.Array) -> jax.Array:
    """Prior quantiles u = Phi(x), to an absolute 1e-16; jax's ndtr, exact in the tails to a
    relative one, compiles into many times as many instructions."""
    return 0.5 * (1.0 + jax.lax.erf(x * math.sqrt(0.5)))


def log_prior(x: jax.Array) -> jax.Array:
    """Standard normal log density at x [n, d]: [n]."""
    return -0.5 * jnp.sum(x**2, axis=-1) - 0.5 * x.shape[-1] * math.log(2.0 * math.pi)


def log_sum_exp(a: jax.Array) -> jax.Array:
    """Over the last axis, along which something must be finite; jax's own takes twice as long
    to compile, for cases that do not occur here."""
    top = jnp.max(a, axis=-1, keepdims=True)
    return top[..., 0] + jnp.log(jnp.sum(jnp.exp(a - top), axis=-1))


def propose(mixture: Mixture, z: jax.Array, uniforms: jax.Array) -> jax.Array:
    """Draws x [n, d] made from normals z [n, d] and `uniforms` [n, UNIFORMS] in (0, 1)."""
    choice, half = uniforms[:, 0], uniforms[:, 1]
    # chi^2 of an even number of degrees is twice a sum of exponentials
    chi_square = -2.0 * jnp.sum(jnp.log(uniforms[:, 2:]), axis=-1)
    scale = jnp.sqrt(DEGREES_OF_FREEDOM / chi_square) * jnp.where(
        half < 0.5, 1.0, mixture.sharpness
    )
    within = (choice - PRIOR_SHARE) / (1.0 - PRIOR_SHARE)
    edges = jnp.cumsum(jnp.exp(mixture.log_share))[:-1]
    component = jnp.sum(within[:, None] > edges, axis=-1)
    shift = jnp.einsum("nij,nj->ni", mixture.factor[component], z)
    fitted = mixture.mean[component] + scale[:, None] * shift
    return jnp.where(choice[:, None] < PRIOR_SHARE, z, fitted)


def fit_mixture(x: jax.Array, log_weights: jax.Array, sharpness: jax.Array) -> Mixture:
    """Expectation maximisation on points x [n, d] with log weights [n].

    Starts by k-means++ (Arthur and Vassilvitskii 2007), which gives a distant mode a
    component even where its weight is small. Covariances are shrunk towards their average,
    as if by d + 2 points, so that few points make no flat component.
    """
    weights = jnp.exp(log_weights - jnp.max(log_weights))
    effective = jnp.sum(weights) ** 2 / jnp.sum(weights**2)
    cumulated = _cumulated(weights)
    positions = (np.arange(RESAMPLED_POINTS) + 0.5) / RESAMPLED_POINTS  # systematic resampling
    drawn = jnp.searchsorted(cumulated, positions * cumulated[-1])
    points = x[jnp.minimum(drawn, len(x) - 1)]
    nearest = _nearest_seed(points / (jnp.std(points, axis=0) + 1e-12))
    shares = jax.nn.one_hot(nearest, COMPONENTS, dtype=x.dtype)
    empty = jnp.zeros((COMPONENTS, *x.shape[1:]))
    factor = jnp.zeros((*empty.shape, x.shape[1]))

    def step(_: int, carried: tuple[Mixture, jax.Array]) -> tuple[Mixture, jax.Array]:
        mixture = _maximised(points, carried[1], effective, sharpness)
        square, volume = _distances(mixture, points)
        return mixture, jax.nn.softmax(mixture.log_share + volume - 0.5 * square, axis=-1)

    start = Mixture(empty[:, 0], empty, factor, factor, sharpness)
    fitted, _ = jax.lax.fori_loop(0, EM_STEPS, step, (start, shares))
    shares = (1.0 - EVEN_SHARE) * jnp.exp(fitted.log_share) + EVEN_SHARE / COMPONENTS
    return fitted._replace(log_share=jnp.log(shares))


def _maximised(
    points: jax.Array, shares: jax.Array, effective: jax.Array, sharpness: jax.Array
) -> Mixture:
    """Components from points [n, d] of which each belongs to them by shares [n, k]."""
    n, d = points.shape
    mass = shares.sum(0) + 1e-12
    mean = (shares.T @ points) / mass[:, None]
    centred = points[:, None, :] - mean
    scatter = jnp.einsum("nk,nki,nkj->kij", shares, centred, centred)
    pooled = scatter.sum(0) / n
    # a floor far below any posterior's width, for points that all coincide
    pooled = pooled + jnp.diag(1e-6 * jnp.diag(pooled) + 1e-16)
    count = effective / n  # a resampled point counts for as much as it is independent
    strength = d + 2.0
    covariance = (count * scatter + strength * pooled) / (count * mass + strength)[:, None, None]
    factor = jnp.linalg.cholesky(covariance)
    eye = jnp.broadcast_to(jnp.eye(d), factor.shape)
    whitener = jax.scipy.linalg.solve_triangular(factor, eye, lower=True)
    return Mixture(jnp.log(mass / mass.sum()), mean, factor, whitener, sharpness)


def _distances(mixture: Mixture, x: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Squared Mahalanobis distances of x [n, d]: [n, k]; log determinants of the whiteners [k]."""
    z = jnp.einsum("kij,nkj->nki", mixture.whitener, x[:, None, :] - mixture.mean)
    diagonals = jnp.diagonal(mixture.whitener, axis1=1, axis2=2)
    return jnp.sum(z**2, axis=-1), jnp.sum(jnp.log(diagonals), axis=-1)


def _log_student(square: jax.Array, d: int) -> jax.Array:
    """Log density of the standard multivariate t at squared distance `square`."""
    constant = math.lgamma(0.5 * (DEGREES_OF_FREEDOM + d)) - math.lgamma(0.5 * DEGREES_OF_FREEDOM)
    constant = constant - 0.5 * d * math.log(DEGREES_OF_FREEDOM * math.pi)
    return constant - 0.5 * (DEGREES_OF_FREEDOM + d) * jnp.log1p(square / DEGREES_OF_FREEDOM)


def _cumulated(weights: jax.Array) -> jax.Array:
    """Cumulative sum of [n], n a multiple of 64, as two small products: jnp.cumsum takes a
    quarter of a second to compile."""
    blocks = weights.reshape(-1, 64)
    within = blocks @ jnp.asarray(np.triu(np.ones((64, 64))))
    before = jnp.asarray(np.tril(np.ones((len(blocks), len(blocks))), -1)) @ within[:, -1]
    return (within + before[:, None]).ravel()


def _nearest_seed(points: jax.Array) -> jax.Array:
    """Which of the k-means++ seeds is nearest to each of points [n, d]: [n]."""
    # always the same noise: a proposal need not be random, and randomness is slow to compile
    gumbel = jnp.asarray(np.random.default_rng(0).gumbel(size=(COMPONENTS, len(points))))
    start = (jnp.sum((points - points[0]) ** 2, axis=-1), jnp.zeros(len(points), int))

    def add(j: int, carried: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        distance, nearest = carried
        chosen = jnp.argmax(jnp.log(distance) + gumbel[j])  # drawn in proportion to distance
        new = jnp.sum((points - points[chosen]) ** 2, axis=-1)
        return jnp.minimum(distance, new), jnp.where(new < distance, j, nearest)

    return jax.lax.fori_loop(1, COMPONENTS, add, start)[1]
