"""NUTS through numpyro, compiled once per shape instead of once per fit."""

from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from numpyro.infer.hmc import hmc

from .base import LogLikelihood
from .target import dispersed_starts, log_density

FIELDS = {
    "lp": lambda s: -s.potential_energy,
    "diverging": lambda s: s.diverging,
    "acceptance_rate": lambda s: s.accept_prob,
    "n_steps": lambda s: s.num_steps,
    "energy": lambda s: s.energy,
    "step_size": lambda s: s.adapt_state.step_size,
}
"""ArviZ's name of each sampler statistic, and where numpyro keeps it."""


class Chains(NamedTuple):
    """What a sampler returns."""

    x: np.ndarray  # [chain, draw, d], unconstrained
    stats: dict[str, np.ndarray]  # name -> [chain, draw]


class Length(NamedTuple):
    """How long to sample; hashable, for it is part of what is compiled."""

    chains: int
    warmup: int
    draws: int


@partial(jax.jit, static_argnames=("log_likelihood", "length"))
def _run(
    key: jax.Array, start: jax.Array, state: Any, *, log_likelihood: LogLikelihood, length: Length
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """All chains at once. `state` is an argument, so a new fit reuses the compiled program."""

    def chain(key: jax.Array, start: jax.Array) -> tuple[jax.Array, dict[str, jax.Array]]:
        # numpyro's functional interface: MCMC objects hold model and data in their cache
        init, step = hmc(
            potential_fn_gen=lambda s: lambda x: -log_density(log_likelihood, s, x), algo="NUTS"
        )
        first = init(start, length.warmup, rng_key=key, model_args=(state,), target_accept_prob=0.9)

        def draw(sampler: Any, _: None) -> tuple[Any, tuple[jax.Array, dict[str, jax.Array]]]:
            sampler = step(sampler, (state,))
            return sampler, (sampler.z, {name: read(sampler) for name, read in FIELDS.items()})

        # one loop for warm-up and draws: the tree doubling is costly to compile twice
        draws = jax.lax.scan(draw, first, None, length=length.warmup + length.draws)[1]
        return jax.tree.map(lambda values: values[length.warmup :], draws)

    return jax.vmap(chain)(jax.random.split(key, length.chains), start)


def sample_nuts(
    key: jax.Array, log_likelihood: LogLikelihood, state: Any, dimension: int, length: Length
) -> Chains:
    """No-U-turn sampling (Hoffman and Gelman 2014) from dispersed starts."""
    start_key, run_key = jax.random.split(key)
    start = dispersed_starts(start_key, log_likelihood, state, (length.chains, dimension))
    x, stats = _run(run_key, start, state, log_likelihood=log_likelihood, length=length)
    return Chains(np.asarray(x), {name: np.asarray(value) for name, value in stats.items()})
