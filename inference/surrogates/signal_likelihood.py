"""The Gaussian likelihood of an emulated signal."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.special import logsumexp

from ..gp.linalg import small_inverse_cholesky
from ..gp.process import GP, predict

WALL = 0.01  # of prior quantiles, beyond a box, over which the likelihood vanishes


class SignalState(NamedTuple):
    """What the likelihood depends on: k scores, g nodes of the noise.

    Scores that are not in use have `used` 0 and count as known.
    """

    gp: GP
    used: jax.Array  # [k], 1 or 0
    estimate: jax.Array  # [g, k], the observed scores
    covariance: jax.Array  # [g, k, k], their error, the simulator's noise included
    log_weight: jax.Array  # [g]
    low: jax.Array  # [d], ends of the box outside of which the likelihood vanishes
    high: jax.Array


def log_likelihood(state: SignalState, u: jax.Array) -> jax.Array:
    """log sum_g w_g N(estimate_g; mu(u), covariance_g + V(u)), V the emulator's variance.

    Bayarri et al. (2009) and Higdon et al. (2008) with the discrepancy's covariance integrated
    out over nodes.
    """
    mean, variance = _scores(state, u)
    return logsumexp(_terms(state, mean, variance)) - _wall(state, u)


def _scores(state: SignalState, u: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Means and variances [k] of the scores at u; outside of the box, those at its end."""
    mean, variance = predict(state.gp, jnp.clip(u, state.low, state.high))
    return mean * state.used, variance * state.used


def _wall(state: SignalState, u: jax.Array) -> jax.Array:
    """What the log likelihood loses outside of the box, Gaussian: gradients can climb it."""
    outside = jnp.maximum(state.low - u, 0.0) + jnp.maximum(u - state.high, 0.0)
    return 0.5 * jnp.sum((outside / WALL) ** 2)


def log_second_moment(state: SignalState, u: jax.Array, spread: jax.Array | None) -> jax.Array:
    """log E[L(u)^2], the expectation over means that vary with variance `spread` [k].

    `spread` is the emulator's variance V (None), or that part of it which further simulations
    will resolve: N(z; m, S)^2 integrates over m ~ N(mu, T), S = C + V - T, to
    |4 pi S|^(-1/2) N(z; mu, S / 2 + T) (Surer et al. 2024). E[L^2] / E[L]^2 is taken from the
    node that speaks loudest at u.
    """
    mean, total = _scores(state, u)
    varying = total if spread is None else spread * state.used
    terms = _terms(state, mean, total)
    loudest = jnp.argmax(terms)
    estimate, covariance = state.estimate[loudest], state.covariance[loudest]
    rest = covariance + jnp.diag(total - varying)
    half = 0.5 * rest.shape[0] * jnp.log(4.0 * jnp.pi) + 0.5 * _log_det(rest)
    second = _log_density(estimate, mean, rest / 2.0 + jnp.diag(varying)) - half
    first = _log_density(estimate, mean, covariance + jnp.diag(total))
    return 2.0 * (logsumexp(terms) - first - _wall(state, u)) + second


def node_log_densities(state: SignalState, u: jax.Array) -> jax.Array:
    """The terms [g] of `log_likelihood`'s sum."""
    return _terms(state, *_scores(state, u))


def _terms(state: SignalState, mean: jax.Array, variance: jax.Array) -> jax.Array:
    covariance = state.covariance + jnp.diag(variance)
    density = jax.vmap(_log_density, (0, None, 0))(state.estimate, mean, covariance)
    return state.log_weight + density


def _log_density(z: jax.Array, mean: jax.Array, covariance: jax.Array) -> jax.Array:
    """log N(z; mean, covariance)."""
    inverse = small_inverse_cholesky(covariance)
    white = inverse @ (z - mean)
    constant = -0.5 * z.shape[0] * jnp.log(2.0 * jnp.pi)
    return jnp.sum(jnp.log(jnp.diag(inverse))) - 0.5 * white @ white + constant


def _log_det(matrix: jax.Array) -> jax.Array:
    return -2.0 * jnp.sum(jnp.log(jnp.diag(small_inverse_cholesky(matrix))))
