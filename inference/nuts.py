"""No-U-turn sampling with jumps between modes, compiled once per shape instead of per fit."""

from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtr

from .base import LogLikelihood
from .mixture import fit_mixture
from .starts import local_factor, look_around, resampled, spread_factor
from .target import Chains, Length, Target, log_density
from .trajectory import (
    STATISTICS,
    Chain,
    Noise,
    Settings,
    StepSize,
    begin,
    draw_noise,
    first_step_size,
    step,
)

STEPS = 2048  # of one call of the compiled program, for which noise is made
BLOCK = 250  # draws that it can hold, whatever number is asked for
FIRST_STEP = 0.7  # in whitened coordinates
TARGETS = (0.9, 0.95, 0.99)
"""Acceptance rates to tune the step size to, each where too many trajectories diverge with the
one before. On sixteen threshold posteriors 0.8 took 4.2 leapfrog steps per draw, and up to
1.5 % of the trajectories diverged; 0.9 took 5.2, and up to 0.3 % did."""
DIVERGENT = 0.003  # share of the warm-up's trajectories
POOR = 60.0  # effective points below which a population is mended by the warm-up
REFITTED = 512  # draws to which the mixture is fitted then

INTEGERS = ("n_steps",)
FLAGS = ("diverging", "jumped")


_refit = jax.jit(fit_mixture)


class Progress(NamedTuple):
    """Of a block of draws, for n chains."""

    chains: Chain
    done: jax.Array  # [n], draws so far
    records: jax.Array  # [n, BLOCK, d + 7]


@partial(jax.jit, static_argnames="log_likelihood")
def _run(
    noise: Noise,
    progress: Progress,
    count: jax.Array,
    state: Any,
    settings: Settings,
    *,
    log_likelihood: LogLikelihood,
) -> Progress:
    """Towards `count` draws of each chain, at most BLOCK, for as long as there is noise.

    All but the likelihood are arguments, so that warm-up, sampling, its continuation and
    another fit use one compiled program.
    """
    n = len(progress.done)
    evaluate = jax.value_and_grad(partial(log_density, log_likelihood, state))

    def unfinished(carried: tuple[jax.Array, Progress]) -> jax.Array:
        time, progress = carried
        return (time < STEPS) & (progress.done < count).any()

    def advance(carried: tuple[jax.Array, Progress]) -> tuple[jax.Array, Progress]:
        time, progress = carried
        now = jax.tree.map(lambda of_steps: of_steps[time], noise)
        # a chain that has its draws waits, so that when the others end decides nothing
        waiting = progress.done >= count
        chains, ended, records = step(progress.chains, waiting, now, settings, evaluate)
        row = jnp.where(ended, progress.done, BLOCK)
        kept = progress.records.at[jnp.arange(n), row].set(records, mode="drop")
        return time + 1, Progress(chains, progress.done + ended, kept)

    return jax.lax.while_loop(unfinished, advance, (jnp.asarray(0), progress))[1]


def sample_nuts(rng: np.random.Generator, target: Target, length: Length) -> Iterator[Chains]:
    """No-U-turn sampling from starts drawn from a weighted population of the posterior.

    Each draw begins with a proposed jump to wherever the population's mixture points; see
    `trajectory`. The metric comes from the population too: the posterior's covariance, or
    the modes' average one where they are separate. Where the population is poor, both come
    from the first half of the warm-up, which otherwise only tunes the step size: its second
    half again, to smaller steps, where trajectories diverge.

    Yields:
        `length.draws` more draws of each chain, without end.
    """
    found = look_around(rng, target)
    poor = float(found.effective) < POOR
    factor = local_factor(found) if poor else spread_factor(found)
    settings = Settings(factor, found.mixture, TARGETS[0], True)
    chains = begin(resampled(rng, found, length.chains), FIRST_STEP)
    first = length.warmup // 2
    if first:
        chains, records = _draws(rng, chains, target, settings, first)
        if poor:
            settings = _mended(settings, records[:, first // 4 :, : target.dimension])
            chains = chains._replace(step_size=first_step_size(length.chains, FIRST_STEP))
    for acceptance in TARGETS:
        settings = settings._replace(target_acceptance=acceptance)
        chains, records = _draws(rng, chains, target, settings, length.warmup - first)
        late = records[:, len(records[0]) // 2 :, target.dimension + STATISTICS.index("diverging")]
        if late.mean() <= DIVERGENT:
            break
    chains = chains._replace(step_size=_pooled(chains))
    settings = settings._replace(adapting=False)
    while True:
        chains, records = _draws(rng, chains, target, settings, length.draws)
        yield _as_chains(records, target.dimension)


def _draws(
    rng: np.random.Generator, chains: Chain, target: Target, settings: Settings, count: int
) -> tuple[Chain, np.ndarray]:
    """`count` draws of each chain: records [n, count, d + 7]."""
    n, d = chains.now.x.shape
    blocks = []
    for start in range(0, count, BLOCK):
        wanted = min(BLOCK, count - start)
        done: Any = np.zeros(n, int)
        empty: Any = np.zeros((n, BLOCK, d + len(STATISTICS)))
        progress = Progress(chains, done, empty)
        while (np.asarray(progress.done) < wanted).any():
            progress = _run(
                draw_noise(rng, (STEPS, n), d),
                progress,
                wanted,
                target.state,
                settings,
                log_likelihood=target.log_likelihood,
            )
        chains = progress.chains
        blocks.append(np.asarray(progress.records)[:, :wanted])
    return chains, np.concatenate(blocks, axis=1)


def _pooled(chains: Chain) -> StepSize:
    """The step size that warm-up found, averaged over the chains."""
    average = np.asarray(chains.step_size.average)
    return chains.step_size._replace(average=np.full_like(average, average.mean()))


def _mended(settings: Settings, x: np.ndarray) -> Settings:
    """Metric and mixture from warm-up draws x [chain, draw, d]."""
    flat = x.reshape(-1, x.shape[-1])
    rows = np.linspace(0, len(flat) - 1, REFITTED).astype(int)
    mixture = _refit(flat[rows], np.zeros(REFITTED), 1.0)
    within = (x - x.mean(1, keepdims=True)).reshape(flat.shape)
    covariance = within.T @ within / len(within)
    floor = 1e-3 * settings.factor @ settings.factor.T
    return settings._replace(factor=np.linalg.cholesky(covariance + floor), mixture=mixture)


def _as_chains(records: np.ndarray, d: int) -> Chains:
    stats: dict[str, np.ndarray] = {}
    for j, name in enumerate(STATISTICS):
        column = records[..., d + j]
        kind = int if name in INTEGERS else bool if name in FLAGS else float
        stats[name] = column.astype(kind)
    return Chains(ndtr(records[..., :d]), stats)
