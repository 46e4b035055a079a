"""Affine-invariant ensemble sampling through emcee."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import ndtr

from .importance import UNIFORMS, Mixture, explore, log_mixture, propose, resampled
from .target import LOG_ZERO, Chains, Length, Target, log_density

if TYPE_CHECKING:
    import emcee

WALKERS = 32
MAX_THIN = 64  # steps; beyond, R-hat and ESS judge instead


def sample_emcee(rng: np.random.Generator, target: Target, length: Length) -> Iterator[Chains]:
    """Stretch, differential-evolution and independence moves; an ensemble of its own per chain.

    Goodman and Weare (2010), ter Braak (2006), and proposals from the mixture of a
    weighted population, by which walkers change between separated modes. Walkers start from
    the population. Of the steps every k-th is kept, k the autocorrelation time of the warm-up.
    Walkers of one ensemble depend on each other, so they do not count as chains. A chain joins
    its walkers end to end, which shows slow mixing to R-hat and ESS.

    Yields:
        `length.draws` more draws of each chain, without end.
    """
    found = explore(rng, target)
    walkers = max(WALKERS, 4 * target.dimension)
    samplers = [_sampler(target, found.mixture, walkers, rng) for _ in range(length.chains)]
    warm = [
        sampler.run_mcmc(
            resampled(rng, found, walkers), length.warmup, skip_initial_state_check=True
        )
        for sampler in samplers
    ]
    thin = max(_autocorrelation_time(np.asarray(s.get_chain())) for s in samplers)
    kept = -(-length.draws // walkers)
    while True:
        runs = []
        for i, sampler in enumerate(samplers):
            sampler.reset()
            warm[i] = sampler.run_mcmc(warm[i], kept, thin_by=thin, skip_initial_state_check=True)
            made = (sampler.get_chain(), sampler.get_log_prob())
            runs.append([_join(np.asarray(values), length.draws) for values in made])
        x, lp = (np.stack(part) for part in zip(*runs, strict=True))
        yield Chains(ndtr(x), {"lp": lp})


def _sampler(
    target: Target, mixture: Mixture, walkers: int, rng: np.random.Generator
) -> "emcee.EnsembleSampler":
    d = target.dimension

    def log_prob(x: np.ndarray) -> np.ndarray:
        values = np.asarray(log_density(target.log_likelihood, x))
        return np.where(np.isfinite(values), values, LOG_ZERO)

    def jump(x: np.ndarray, random: Any) -> tuple[np.ndarray, np.ndarray]:
        uniforms = 1.0 - random.random_sample((len(x), UNIFORMS))
        new = propose(mixture, random.standard_normal(x.shape), uniforms)
        return new, log_mixture(mixture, x) - log_mixture(mixture, new)

    import emcee  # loaded on use, as are all that one sampler alone needs

    moves = [
        (emcee.moves.DEMove(), 0.4),
        (emcee.moves.StretchMove(), 0.2),
        (emcee.moves.MHMove(jump), 0.4),
    ]
    sampler = emcee.EnsembleSampler(walkers, d, log_prob, moves=moves, vectorize=True)
    seed = int(rng.integers(2**31))
    sampler.random_state = np.random.RandomState(seed).get_state()  # emcee wants this one
    return sampler


def _autocorrelation_time(x: np.ndarray) -> int:
    """In steps, of the slowest coordinate of x [step, walker, d]; from 1 to MAX_THIN."""
    import emcee

    times = emcee.autocorr.integrated_time(x, tol=0)
    slowest = float(np.max(times)) if np.isfinite(times).all() else MAX_THIN
    return int(np.clip(np.ceil(slowest), 1, MAX_THIN))


def _join(values: np.ndarray, draws: int) -> np.ndarray:
    """[step, walker, ...] -> [draw, ...], walker after walker."""
    joined = np.swapaxes(values, 0, 1).reshape(-1, *values.shape[2:])
    return joined[:draws]
