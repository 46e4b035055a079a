"""A weighted population of points that stands for the posterior, modes and their weights included.

Adaptive importance sampling: a quasi-random screen of the prior, then rounds of proposals from
a mixture fitted to what was found so far, tempered while the posterior is too narrow for it.
All points of all rounds count, weighted by the mixture of everything that proposed (Cornuet et
al. 2012, adaptive multiple importance sampling; Veach and Guibas 1995, balance heuristic).
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.special import logsumexp, ndtr, ndtri
from jax.scipy.stats import norm

from .base import LogLikelihood
from .design import sobol
from .mixture import COMPONENTS, Mixture, fit_mixture, log_density, propose, uniforms_needed

ROUND = 256  # points of each round
SCREENS = 4  # rounds that fill the prior evenly
ROUNDS = 16  # at most; an easy posterior stops after six or seven
ENOUGH = 400.0  # effective points at which one more round ends it
EDGE = 1e-12  # quantile at which the box is cut, so that x = Phi^-1(u) stays finite
COLDEST = -60.0  # log of the smallest inverse temperature
SHARPENED = 0.5  # width of half the proposals, while the temperature still has to fall


class Population(NamedTuple):
    """Weighted points, and the mixture that proposes more of their kind.

    Coordinates x = Phi^-1(u), in which the prior is standard normal.
    """

    x: jax.Array  # [n, d]
    log_likelihood: jax.Array  # [n]
    log_weights: jax.Array  # [n]; their logsumexp estimates the log evidence; -inf: not used
    mixture: Mixture
    effective: jax.Array  # [], effective number of points, (sum w)^2 / sum w^2
    evaluations: jax.Array  # [], points at which the likelihood was evaluated


class _Progress(NamedTuple):
    round: jax.Array
    x: jax.Array  # [n, d]; zeros where not yet proposed
    log_likelihood: jax.Array  # [n]; -inf where not yet proposed
    log_mass: jax.Array  # [n], log of sum_r n_r q_r(x) over the rounds so far
    history: Mixture  # of each round, stacked
    before: jax.Array  # effective points before the last round
    effective: jax.Array


def population(
    key: jax.Array, log_likelihood: LogLikelihood, state: Any, dimension: int
) -> tuple[jax.Array, jax.Array]:
    """Weighted points of the posterior over prior quantiles.

    About 1500 to 2500 evaluations, in batches of 256; up to 4096 for posteriors so narrow
    that they must be approached in steps. Compiled once per likelihood and shape of state;
    to be called under 64-bit types, also from within other compiled functions.

    Args:
        key: Fixes the points.
        log_likelihood: Module-level function (state, u [d]) -> scalar; what is not finite
            counts as zero likelihood.
        state: Its first argument, a pytree.
        dimension: d.

    Returns:
        u [n, d] and log weights [n]: sum_i w_i f(u_i) / sum_i w_i estimates the posterior
        mean of f, and logsumexp of the log weights the log evidence. n is constant; unused
        rows have log weight -inf.
    """
    found = explore(key, log_likelihood, state, dimension)
    return ndtr(found.x), found.log_weights


@partial(jax.jit, static_argnames=("log_likelihood", "dimension"))
def explore(
    key: jax.Array, log_likelihood: LogLikelihood, state: Any, dimension: int
) -> Population:
    """`population`, with what samplers need besides."""
    # all randomness in one call, for each costs a quarter of a second to compile: the same
    # Sobol points in every round, each time under another shift
    columns = uniforms_needed(dimension)
    shifts = jax.random.uniform(key, (ROUNDS, columns))
    cloud = jnp.asarray(sobol(1, 0, ROUND, columns))
    # the screen under one shift, so that its rounds continue one sequence
    screen = jnp.asarray(sobol(0, 0, ROUND * SCREENS, dimension)) + shifts[0, :dimension]
    screen = ndtri(_into_box(screen)).reshape(SCREENS, ROUND, dimension)

    def unfinished(now: _Progress) -> jax.Array:
        return (now.round <= SCREENS) | ((now.round < ROUNDS) & (now.before < ENOUGH))

    def advance(now: _Progress) -> _Progress:
        mixture = fit_mixture(now.x, *_bearable(now))
        screening = now.round < SCREENS
        proposed = propose(mixture, _into_box(cloud + shifts[now.round]))
        new = jnp.where(screening, screen[jnp.minimum(now.round, SCREENS - 1)], proposed)
        values = jax.vmap(log_likelihood, in_axes=(None, 0))(state, ndtr(new))
        return _weighed(now, mixture, new, jnp.where(jnp.isfinite(values), values, -jnp.inf))

    last = jax.lax.while_loop(unfinished, advance, _nothing(dimension))
    return Population(
        x=last.x,
        log_likelihood=last.log_likelihood,
        log_weights=_log_weights(last, 1.0),
        mixture=jax.tree.map(lambda leaf: leaf[last.round - 1], last.history),
        effective=last.effective,
        evaluations=ROUND * last.round,
    )


def _nothing(dimension: int) -> _Progress:
    n = ROUND * ROUNDS
    square = jnp.zeros((ROUNDS, COMPONENTS, dimension, dimension))
    history = Mixture(square[..., 0, 0], square[..., 0], square, square, jnp.ones(ROUNDS))
    none = jnp.full(n, -jnp.inf)
    zero = jnp.asarray(0.0)
    return _Progress(jnp.asarray(0), jnp.zeros((n, dimension)), none, none, history, zero, zero)


def _into_box(u: jax.Array) -> jax.Array:
    return jnp.clip(u % 1.0, EDGE, 1.0 - EDGE)


def _weighed(now: _Progress, mixture: Mixture, new: jax.Array, values: jax.Array) -> _Progress:
    """Add points `new` [ROUND, d] that `mixture`, or a screen, proposed; weigh all anew."""
    history = jax.tree.map(lambda kept, leaf: kept.at[now.round].set(leaf), now.history, mixture)
    each = jnp.log(float(ROUND))
    screening = now.round < SCREENS
    of_old = jnp.where(screening, _log_prior(now.x), log_density(mixture, now.x))
    rounds = jax.vmap(log_density, in_axes=(0, None))(history, new)
    index = jnp.arange(ROUNDS)[:, None]
    rounds = jnp.where(index < SCREENS, _log_prior(new), rounds)
    of_new = logsumexp(jnp.where(index <= now.round, rounds, -jnp.inf), axis=0)
    row = ROUND * now.round
    after = now._replace(
        round=now.round + 1,
        x=jax.lax.dynamic_update_slice(now.x, new, (row, 0)),
        log_likelihood=jax.lax.dynamic_update_slice(now.log_likelihood, values, (row,)),
        log_mass=jax.lax.dynamic_update_slice(
            jnp.logaddexp(now.log_mass, each + of_old), each + of_new, (row,)
        ),
        history=history,
        before=now.effective,
    )
    return after._replace(effective=_effective(_log_weights(after, 1.0)))


def _bearable(now: _Progress) -> tuple[jax.Array, jax.Array]:
    """Log weights for the largest power of the likelihood that leaves enough effective points
    (bisection), and how much narrower than these the next proposals may be."""
    enough = 32.0 + 16.0 * now.x.shape[1]

    def halve(_: int, bounds: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        low, high = bounds
        middle = 0.5 * (low + high)
        fits = _effective(_log_weights(now, jnp.exp(middle))) >= enough
        return jnp.where(fits, middle, low), jnp.where(fits, high, middle)

    low, _ = jax.lax.fori_loop(0, 30, halve, (jnp.asarray(COLDEST), jnp.asarray(0.0)))
    cold = now.effective >= enough
    return _log_weights(now, jnp.where(cold, 1.0, jnp.exp(low))), jnp.where(cold, 1.0, SHARPENED)


def _log_weights(now: _Progress, power: jax.Array | float) -> jax.Array:
    """Log of likelihood^power times prior over proposals' mass; flat where all are zero."""
    finite = jnp.isfinite(now.log_likelihood)
    tempered = jnp.where(finite, power * now.log_likelihood, -jnp.inf)
    return jnp.where(
        finite.any(),
        tempered + _log_prior(now.x) - now.log_mass,
        jnp.where(jnp.arange(len(now.x)) < ROUND * SCREENS, -jnp.log(ROUND * SCREENS), -jnp.inf),
    )


def _effective(log_weights: jax.Array) -> jax.Array:
    """Kish's effective number of points."""
    return jnp.exp(2.0 * logsumexp(log_weights) - logsumexp(2.0 * log_weights))


def _log_prior(x: jax.Array) -> jax.Array:
    return jnp.sum(norm.logpdf(x), axis=-1)
