"""Affine-invariant ensemble sampling through emcee."""

from functools import partial
from typing import Any

import emcee
import jax
import numpy as np

from .base import LogLikelihood
from .nuts import Chains, Length
from .target import dispersed_starts, log_density

WALKERS = 32
THIN = 25  # steps between kept ensembles, near the autocorrelation time in few dimensions


@partial(jax.jit, static_argnums=0)
def _log_densities(log_likelihood: LogLikelihood, state: Any, x: jax.Array) -> jax.Array:
    return jax.vmap(log_density, in_axes=(None, None, 0))(log_likelihood, state, x)


def sample_emcee(
    key: jax.Array, log_likelihood: LogLikelihood, state: Any, dimension: int, length: Length
) -> Chains:
    """The stretch move (Goodman and Weare 2010); one independent ensemble per chain.

    Walkers of one ensemble depend on each other, so they do not count as chains. A chain
    joins its walkers end to end, which shows slow mixing to R-hat and ESS.
    """

    def log_prob(x: np.ndarray) -> np.ndarray:
        return np.asarray(_log_densities(log_likelihood, state, x))

    walkers = max(WALKERS, 4 * dimension)
    kept = -(-length.draws // walkers)
    runs = []
    for chain in jax.random.split(key, length.chains):
        start_key, run_key = jax.random.split(chain)
        start = dispersed_starts(start_key, log_likelihood, state, (walkers, dimension))
        sampler = emcee.EnsembleSampler(walkers, dimension, log_prob, vectorize=True)
        legacy_seed = int(jax.random.randint(run_key, (), 0, 2**31 - 1))
        sampler.random_state = np.random.RandomState(legacy_seed).get_state()  # noqa: NPY002  emcee's own
        warm = sampler.run_mcmc(start, length.warmup, store=False)
        sampler.run_mcmc(warm, kept, thin_by=THIN)
        runs.append((sampler.get_chain(), sampler.get_log_prob()))
    x = np.stack([_join(chain, length.draws) for chain, _ in runs])
    lp = np.stack([_join(log_probs, length.draws) for _, log_probs in runs])
    return Chains(x, {"lp": lp, "diverging": np.zeros(lp.shape, bool)})


def _join(values: np.ndarray, draws: int) -> np.ndarray:
    """[step, walker, ...] -> [draw, ...], walker after walker."""
    joined = np.swapaxes(values, 0, 1).reshape(-1, *values.shape[2:])
    return joined[:draws]
