"""numpyro's NUTS with jumps between modes, compiled once per shape instead of once per fit."""

from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.infer.hmc import HMCState, hmc

from ..types import LogLikelihood
from .mixture import (
    UNIFORMS,
    Mixture,
    fit_mixture,
    propose,
    to_unit,
)
from .mixture import log_density as log_mixture
from .starts import (
    local_factor,
    look_around,
    resampled,
    spread_factor,
)
from .target import (
    Chains,
    Length,
    Target,
    log_density,
)

BLOCK = 250  # draws of one call of the compiled program, whatever number is asked for
FIRST_STEP = 0.7  # in whitened coordinates
TARGET_ACCEPTANCE = 0.9  # share that the step size aims at; at 0.8 more than 1 % may diverge
POOR_EFFECTIVE = 60.0  # effective points below which a population is mended by a first warm-up
REFITTED_DRAWS = 512  # draws to which the mixture is fitted then

STATISTICS = {
    "lp": lambda s: -s.potential_energy,
    "diverging": lambda s: s.diverging,
    "acceptance_rate": lambda s: s.accept_prob,
    "n_steps": lambda s: s.num_steps,
    "energy": lambda s: s.energy,
    "step_size": lambda s: s.adapt_state.step_size,
}
"""ArviZ's name of each sampler statistic, and where numpyro keeps it."""


class Guide(NamedTuple):
    """Metric and jump proposal, estimated from the population."""

    factor: jax.Array  # [d, d], x = factor y: the posterior is about as wide in every y
    mixture: Mixture  # over x, proposes jumps


class Block(NamedTuple):
    """Draws of all chains."""

    last: HMCState
    u: jax.Array  # [chain, BLOCK, d], prior quantiles
    stats: dict[str, jax.Array]  # name -> [chain, BLOCK]


def _sampler(log_likelihood: LogLikelihood) -> tuple[Any, Any]:
    """numpyro's functional interface: its MCMC objects hold model and data in their cache."""

    def potential(state: Any, factor: jax.Array) -> Any:
        return lambda y: -log_density(log_likelihood, state, factor @ y)

    return potential, hmc(potential_fn_gen=potential, algo="NUTS")


def _begin_one(
    y: jax.Array, key: jax.Array, kernel: Any, arguments: tuple[Any, jax.Array], warmup: int
) -> HMCState:
    return kernel(
        y,
        warmup,
        step_size=FIRST_STEP,
        adapt_mass_matrix=False,
        target_accept_prob=TARGET_ACCEPTANCE,
        model_args=arguments,
        rng_key=key,
    )


@partial(jax.jit, static_argnames=("log_likelihood", "warmup"))
def _begin(
    y: jax.Array, keys: jax.Array, state: Any, guide: Guide, *, log_likelihood: Any, warmup: int
) -> HMCState:
    """Chains at y [chain, d], about to adapt their step size for `warmup` draws."""
    _, (kernel, _) = _sampler(log_likelihood)
    arguments = state, guide.factor
    return jax.vmap(lambda y, key: _begin_one(y, key, kernel, arguments, warmup))(y, keys)


@partial(jax.jit, static_argnames=("log_likelihood", "warmup"))
def _run(
    last: HMCState, keys: jax.Array, state: Any, guide: Guide, *, log_likelihood: Any, warmup: int
) -> Block:
    """BLOCK more draws of each chain.

    Likelihood state and guide are arguments, so that another fit reuses the compiled program.
    """
    potential, (kernel, step) = _sampler(log_likelihood)
    arguments = state, guide.factor

    def chain(last: HMCState, key: jax.Array) -> Block:
        # numpyro's step knows its settings from the kernel that began; this one is not run
        _begin_one(last.z, key, kernel, arguments, warmup)

        def draw(now: HMCState, key: jax.Array) -> tuple[HMCState, tuple[Any, Any]]:
            now = step(_jumped(key, now, potential(*arguments), guide), arguments)
            stats = {name: read(now) for name, read in STATISTICS.items()}
            return now, (to_unit(guide.factor @ now.z), stats)

        end, (u, stats) = jax.lax.scan(draw, last, jax.random.split(key, BLOCK))
        return Block(end, u, stats)

    return jax.vmap(chain)(last, keys)


def _jumped(key: jax.Array, now: HMCState, potential: Any, guide: Guide) -> HMCState:
    """An independence step of Metropolis and Hastings, proposed by the mixture.

    It keeps the posterior, as the trajectory after it does, and moves chains between modes
    that no path connects.
    """
    normal, uniform, accept = jax.random.split(key, 3)
    d = len(now.z)
    z = jax.random.normal(normal, (1, d))
    target = propose(guide.mixture, z, jax.random.uniform(uniform, (1, UNIFORMS)))[0]
    y = jax.scipy.linalg.solve_triangular(guide.factor, target, lower=True)
    energy, gradient = jax.value_and_grad(potential)(y)
    old, new = log_mixture(guide.mixture, jnp.stack([guide.factor @ now.z, target]))
    log_ratio = now.potential_energy - energy + old - new
    moved = now._replace(z=y, z_grad=gradient, potential_energy=energy)
    accepted = jnp.log(jax.random.uniform(accept)) < log_ratio
    return jax.tree.map(lambda new, old: jnp.where(accepted, new, old), moved, now)


def sample_nuts(rng: np.random.Generator, target: Target, length: Length) -> Iterator[Chains]:
    """No-U-turn sampling (Hoffman and Gelman 2014), each draw after a proposed jump.

    Chains start from a weighted population of the posterior, whose mixture proposes the jumps.
    The metric comes from it too: the posterior's covariance, or the modes' average one where
    they are separate. Where the population is poor, both come from a first warm-up.

    Yields:
        `length.draws` more draws of each chain, without end.
    """
    found = look_around(rng, target)
    start = resampled(rng, found, length.chains)
    poor = float(found.effective) < POOR_EFFECTIVE
    factor = local_factor(found) if poor else spread_factor(found)
    guide = Guide(jnp.asarray(factor), found.mixture)
    blocks = _blocks(rng, target, guide, start, length.warmup)
    if poor:
        first = _take(blocks, length.warmup, [])
        x = np.asarray(jax.scipy.special.ndtri(first.u[:, length.warmup // 2 :]))
        guide = _mended(guide, x)
        blocks = _blocks(rng, target, guide, x[:, -1], length.warmup)
    left: list[Chains] = []
    _take(blocks, length.warmup, left)
    while True:
        yield _take(blocks, length.draws, left)


def _blocks(
    rng: np.random.Generator, target: Target, guide: Guide, start: np.ndarray, warmup: int
) -> Iterator[Chains]:
    """Blocks of draws from x [chain, d], the warm-up's among them, without end."""
    y = np.linalg.solve(np.asarray(guide.factor), start.T).T
    fixed = {"log_likelihood": target.log_likelihood, "warmup": warmup}

    def keys() -> jax.Array:
        return jax.random.split(jax.random.key(int(rng.integers(2**31))), len(y))

    last = _begin(y, keys(), target.state, guide, **fixed)
    while True:
        block = _run(last, keys(), target.state, guide, **fixed)
        last = block.last
        yield Chains(np.asarray(block.u), {n: np.asarray(s) for n, s in block.stats.items()})


def _take(blocks: Iterator[Chains], count: int, left: list[Chains]) -> Chains:
    """The next `count` draws; what remains of the last block goes to `left`."""
    parts, have = left[:], sum(part.u.shape[1] for part in left)
    while have < count:
        parts.append(next(blocks))
        have += parts[-1].u.shape[1]
    whole = jax.tree.map(lambda *arrays: np.concatenate(arrays, axis=1), *parts)
    left[:] = [jax.tree.map(lambda array: array[:, count:], whole)]
    return jax.tree.map(lambda array: array[:, :count], whole)


def _mended(guide: Guide, x: np.ndarray) -> Guide:
    """Metric and mixture from warm-up draws x [chain, draw, d]."""
    flat = x.reshape(-1, x.shape[-1])
    rows = np.linspace(0, len(flat) - 1, REFITTED_DRAWS).astype(int)
    mixture = _refit(flat[rows], np.zeros(REFITTED_DRAWS), 1.0)
    within = (x - x.mean(1, keepdims=True)).reshape(flat.shape)
    covariance = within.T @ within / len(within)
    floor = 1e-3 * guide.factor @ guide.factor.T
    return Guide(jnp.asarray(np.linalg.cholesky(covariance + floor)), mixture)


_refit = jax.jit(fit_mixture)
