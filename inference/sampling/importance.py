"""A weighted population of points that stands for the posterior, modes and their weights included.

Adaptive importance sampling: a quasi-random screen of the prior, then rounds of proposals from
a mixture fitted to what was found so far, tempered while the posterior is too narrow for it.
All points of all rounds count, weighted by the mixture of everything that proposed (Cornuet et
al. 2012, adaptive multiple importance sampling; Veach and Guibas 1995, balance heuristic).
"""

import math
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtri

from ..sobol import sobol
from ..types import LogLikelihood
from .mixture import (
    COMPONENTS,
    UNIFORMS,
    Mixture,
    fit_mixture,
    log_density,
    log_prior,
    log_sum_exp,
    propose,
    to_unit,
)

ROUND_POINTS = 256  # points of each round
SCREEN_ROUNDS = 4  # rounds that fill the prior evenly
MAX_ROUNDS = 16  # at most; an easy posterior stops after six or seven
MIN_EFFECTIVE = 400.0  # effective points at which one more round ends it
BOX_EDGE = 1e-12  # quantile at which the box is cut, so that x = Phi^-1(u) stays finite
MIN_LOG_POWER = -60.0  # log of the smallest inverse temperature
SHARPENED_WIDTH = 0.5  # width of half the proposals, while the temperature still has to fall


class Population(NamedTuple):
    """Weighted points, and the mixture that proposes more of their kind.

    Coordinates x = Phi^-1(u), in which the prior is standard normal. sum_i w_i f(x_i) / sum_i w_i
    estimates the posterior mean of f; n is constant.
    """

    x: jax.Array  # [n, d]
    log_likelihood: jax.Array  # [n]
    log_weights: jax.Array  # [n]; their logsumexp estimates the log evidence; -inf: not used
    mixture: Mixture
    log_proposal: jax.Array  # [n], log density of the mixture
    effective: jax.Array  # [], effective number of points, (sum w)^2 / sum w^2
    evaluations: jax.Array  # [], points at which the likelihood was evaluated


class _Progress(NamedTuple):
    round: jax.Array
    x: jax.Array  # [n, d]; zeros where not yet proposed
    log_likelihood: jax.Array  # [n]; -inf where not yet proposed
    log_mass: jax.Array  # [n], log of sum_r n_r q_r(x) over the screen and the rounds so far
    log_proposal: jax.Array  # [n], log density of the last round's mixture
    history: Mixture  # of each round after the screen, stacked
    before: jax.Array  # effective points before the last round
    effective: jax.Array


@partial(jax.jit, static_argnames=("log_likelihood", "dimension"))
def explore(
    key: jax.Array, log_likelihood: LogLikelihood, state: Any, dimension: int
) -> Population:
    """Weighted points of the posterior, and what proposes more of them.

    About 1500 to 2500 evaluations, in batches of 256; up to 4096 for posteriors so narrow
    that they must be approached in steps. Compiled once per likelihood and shape of state;
    to be called under 64-bit types, also from within other compiled functions.

    Args:
        key: Fixes the points.
        log_likelihood: Module-level function (state, u [d]) -> scalar; what is not finite
            counts as zero likelihood.
        state: Its first argument, a pytree.
        dimension: d.
    """
    shifts = _shifts(key, dimension + UNIFORMS)
    points = jnp.asarray(_quasi_random(dimension))

    def unfinished(now: _Progress) -> jax.Array:
        return (now.round <= SCREEN_ROUNDS) | (
            (now.round < MAX_ROUNDS) & (now.before < MIN_EFFECTIVE)
        )

    def advance(now: _Progress) -> _Progress:
        screening = now.round < SCREEN_ROUNDS
        # the screen under one shift, so that its rounds continue one sequence
        shift = shifts[jnp.where(screening, 0, now.round)]
        uniforms = jnp.clip(
            (points[jnp.minimum(now.round, SCREEN_ROUNDS)] + shift) % 1.0, BOX_EDGE, 1 - BOX_EDGE
        )
        z = ndtri(uniforms[:, :dimension])
        fresh = jax.lax.cond(screening, _screened, _proposed, now, z, uniforms[:, dimension:])
        values = jax.vmap(log_likelihood, in_axes=(None, 0))(state, to_unit(fresh.x))
        return _weighed(now, fresh, jnp.where(jnp.isfinite(values), values, -jnp.inf))

    last = jax.lax.while_loop(unfinished, advance, _nothing(dimension))
    return Population(
        x=last.x,
        log_likelihood=last.log_likelihood,
        log_weights=_log_weights(last, 1.0),
        mixture=jax.tree.map(lambda leaf: leaf[last.round - SCREEN_ROUNDS - 1], last.history),
        log_proposal=last.log_proposal,
        effective=last.effective,
        evaluations=ROUND_POINTS * last.round,
    )


def _nothing(dimension: int) -> _Progress:
    rows, later = ROUND_POINTS * MAX_ROUNDS, MAX_ROUNDS - SCREEN_ROUNDS
    square = jnp.zeros((later, COMPONENTS, dimension, dimension))
    history = Mixture(square[..., 0, 0], square[..., 0], square, square, jnp.ones(later))
    none, zero = jnp.full(rows, -jnp.inf), jnp.asarray(0.0)
    x = jnp.zeros((rows, dimension))
    mass = math.log(ROUND_POINTS * SCREEN_ROUNDS) + log_prior(
        x
    )  # finite, though these rows are never used
    return _Progress(jnp.asarray(0), x, none, mass, none, history, zero, zero)


def _shifts(key: jax.Array, columns: int) -> jax.Array:
    """Numbers [MAX_ROUNDS, columns] in [0, 1), each uniform over the keys.

    Fixed odd multiples of the key's words, modulo 2^32: jax.random takes a quarter of a
    second to compile, for a few dozen numbers that only move quasi-random points.
    """
    words = jax.random.key_data(key).astype(jnp.uint32).reshape(-1)
    shape = (len(words), MAX_ROUNDS, columns)
    odd = 2 * np.random.default_rng(0).integers(2**31, size=shape, dtype=np.uint32) + 1
    mixed = jnp.sum(words[:, None, None] * odd, axis=0, dtype=jnp.uint32)
    return mixed / 2.0**32


def _quasi_random(dimension: int) -> np.ndarray:
    """Sobol points in (0, 1), [SCREEN_ROUNDS + 1, ROUND_POINTS, dimension + UNIFORMS].

    Those of the screen continue each other over its first `dimension` columns; the last are
    shifted anew in each later round.
    """
    columns = dimension + UNIFORMS
    points = np.full((SCREEN_ROUNDS + 1, ROUND_POINTS, columns), 0.5)
    screen = sobol(0, 0, ROUND_POINTS * SCREEN_ROUNDS, dimension)
    points[:SCREEN_ROUNDS, :, :dimension] = screen.reshape(SCREEN_ROUNDS, ROUND_POINTS, dimension)
    points[SCREEN_ROUNDS] = sobol(1, 0, ROUND_POINTS, columns)
    return points


class _Fresh(NamedTuple):
    """Points to evaluate, and what proposing them changed."""

    x: jax.Array  # [ROUND_POINTS, d]
    log_mass: jax.Array  # [n], of the points so far
    log_proposal: jax.Array  # [n]
    history: Mixture


def _screened(now: _Progress, z: jax.Array, uniforms: jax.Array) -> _Fresh:
    """Points of the prior itself."""
    return _Fresh(z, now.log_mass, now.log_proposal, now.history)


def _proposed(now: _Progress, z: jax.Array, uniforms: jax.Array) -> _Fresh:
    """Points of a mixture fitted to those so far."""
    mixture = fit_mixture(now.x, *_tempered_weights(now))
    density = log_density(mixture, now.x)
    row = now.round - SCREEN_ROUNDS
    return _Fresh(
        propose(mixture, z, uniforms),
        jnp.logaddexp(now.log_mass, math.log(ROUND_POINTS) + density),
        density,
        jax.tree.map(lambda kept, leaf: kept.at[row].set(leaf), now.history, mixture),
    )


def _weighed(now: _Progress, fresh: _Fresh, values: jax.Array) -> _Progress:
    """Add points and their log likelihoods, and weigh all anew."""
    rounds = jax.vmap(log_density, in_axes=(0, None))(fresh.history, fresh.x)
    done = jnp.arange(MAX_ROUNDS - SCREEN_ROUNDS)[:, None] <= now.round - SCREEN_ROUNDS
    rounds = math.log(ROUND_POINTS) + jnp.where(done, rounds, -jnp.inf)
    screen = math.log(ROUND_POINTS * SCREEN_ROUNDS) + log_prior(fresh.x)
    mass = log_sum_exp(jnp.concatenate([screen[:, None], rounds.T], axis=1))
    last = rounds[jnp.maximum(now.round - SCREEN_ROUNDS, 0)] - math.log(ROUND_POINTS)
    row = ROUND_POINTS * now.round

    def added(old: jax.Array, new: jax.Array) -> jax.Array:
        return jax.lax.dynamic_update_slice(old, new, (row, 0)[: old.ndim])

    after = _Progress(
        round=now.round + 1,
        x=added(now.x, fresh.x),
        log_likelihood=added(now.log_likelihood, values),
        log_mass=added(fresh.log_mass, mass),
        log_proposal=added(fresh.log_proposal, last),
        history=fresh.history,
        before=now.effective,
        effective=now.effective,
    )
    return after._replace(effective=_effective(_log_weights(after, 1.0)))


def _tempered_weights(now: _Progress) -> tuple[jax.Array, jax.Array]:
    """Tempered log weights, and the width factor of the next proposals.

    The power of the likelihood is the largest that leaves enough effective points (bisection).
    """
    enough = 32.0 + 16.0 * now.x.shape[1]

    def halve(_: int, bounds: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        low, high = bounds
        middle = 0.5 * (low + high)
        fits = _effective(_log_weights(now, jnp.exp(middle))) >= enough
        return jnp.where(fits, middle, low), jnp.where(fits, high, middle)

    cold = now.effective >= enough
    steps = jnp.where(cold, 0, 30)
    low, _ = jax.lax.fori_loop(0, steps, halve, (jnp.asarray(MIN_LOG_POWER), jnp.asarray(0.0)))
    return _log_weights(now, jnp.where(cold, 1.0, jnp.exp(low))), jnp.where(
        cold, 1.0, SHARPENED_WIDTH
    )


def _log_weights(now: _Progress, power: jax.Array | float) -> jax.Array:
    """Log of likelihood^power times prior over proposals' mass; flat where all are zero."""
    finite = jnp.isfinite(now.log_likelihood)
    tempered = jnp.where(finite, power * now.log_likelihood, -jnp.inf)
    return jnp.where(
        finite.any(),
        tempered + log_prior(now.x) - now.log_mass,
        jnp.where(
            jnp.arange(len(now.x)) < ROUND_POINTS * SCREEN_ROUNDS,
            -math.log(ROUND_POINTS * SCREEN_ROUNDS),
            -jnp.inf,
        ),
    )


def _effective(log_weights: jax.Array) -> jax.Array:
    """Kish's effective number of points."""
    weights = jnp.exp(log_weights - jnp.max(log_weights))
    return jnp.sum(weights) ** 2 / jnp.sum(weights**2)
