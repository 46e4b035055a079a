"""numpyro's NUTS with jumps between modes, compiled once per shape instead of once per fit."""

from collections.abc import Iterator, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.infer.hmc import HMCState, hmc
from numpyro.infer.util import ParamInfo
from scipy.special import ndtr, ndtri

from ..gp.process import GP
from ..gp.process import padded as padded_process
from ..types import LogLikelihood
from .compilation_cache import kept_compilations
from .importance import (
    UNIFORMS,
    Mixture,
    Population,
    explore,
    fit_mixture,
    log_mixture,
    propose,
    resampled,
)
from .target import Chains, Length, Target, log_density

BLOCK = 250  # draws of one call of the compiled program, whatever number is asked for
FIRST_STEP = 0.7  # in whitened coordinates
TARGET_ACCEPTANCE = 0.9  # share that the step size aims at; at 0.8 more than 1 % may diverge
POOR_EFFECTIVE = 60.0  # effective points below which a population is mended by a first warm-up
REFITTED_DRAWS = 512  # draws to which the mixture is fitted then
SEPARATE_MODES_GAIN = 0.5  # in mean log density over one Gaussian: modes then count as separate

XLA_OPTIONS = {"xla_cpu_use_fusion_emitters": False}
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

    factor: np.ndarray  # [d, d], x = factor y: the posterior is about as wide in every y
    mixture: Mixture  # over x, proposes jumps


class Jumps(NamedTuple):
    """Proposed jumps of one chain, made by NumPy: they depend on no draw."""

    y: np.ndarray  # [n, d]
    log_proposal: np.ndarray  # [n], log density of the mixture
    log_uniform: np.ndarray  # [n], with which a jump is accepted; -inf accepts it


# compiled within: it is traced and lowered once, though a step and a jump evaluate it
_log_density = jax.jit(log_density)


def _sampler() -> tuple[Any, Any]:
    """numpyro's functional interface: its MCMC objects hold model and data in their cache."""

    def potential(likelihood: LogLikelihood, factor: jax.Array) -> Any:
        return lambda y: -_log_density(likelihood, (factor @ y)[None])[0]

    return potential, hmc(potential_fn_gen=potential, algo="NUTS")


def _settings(y: jax.Array, seed: jax.Array, warmup: int) -> dict[str, Any]:
    nothing = jnp.zeros(())
    return {
        # the first jump, which is accepted, evaluates the start: one copy less of the likelihood
        "init_params": ParamInfo(y, nothing, jnp.zeros_like(y)),
        "num_warmup": warmup,
        "step_size": FIRST_STEP,
        "adapt_mass_matrix": False,
        "target_accept_prob": TARGET_ACCEPTANCE,
        "model_args": (None, None),
        "rng_key": jax.random.key(seed, impl="threefry2x32"),
    }


@partial(jax.jit, static_argnames="warmup")
def _begin(y: jax.Array, seed: jax.Array, *, warmup: int) -> HMCState:
    """A chain at y [d], about to adapt its step size for `warmup` draws."""
    return _sampler()[1][0](**_settings(y, seed, warmup))


def _run(
    last: HMCState, likelihood: LogLikelihood, guide: Guide, jumps: Jumps, *, warmup: int
) -> tuple[HMCState, Any]:
    """One more draw for each jump: the last state, prior quantiles [n, d] and statistics [n].

    Likelihood and guide are arguments, so that another fit reuses the compiled program.
    Chains call it one by one: batched by `vmap` it takes twice as long to compile.
    """
    potential, (kernel, step) = _sampler()
    arguments = likelihood, guide.factor
    # numpyro's step knows its settings from the kernel that began; this one is not run
    kernel(**_settings(last.z, jnp.zeros((), jnp.uint32), warmup))

    def draw(now: HMCState, jump: Jumps) -> tuple[HMCState, tuple[Any, Any]]:
        now = step(_jumped(jump, now, potential(*arguments), guide), arguments)
        stats = {name: read(now) for name, read in STATISTICS.items()}
        return now, (guide.factor @ now.z, stats)

    return jax.lax.scan(draw, last, jumps)


@cache
def _compiled_run() -> Any:
    """`_run`, without XLA's fusion emitters: with them it takes half as long again to compile, and
    runs no faster."""
    options: dict[str, bool] | None = XLA_OPTIONS
    try:
        jax.jit(lambda x: x + 1, compiler_options=options)(0)
    except jax.errors.JaxRuntimeError:  # an XLA that knows no such option
        options = None
    return jax.jit(_run, static_argnames="warmup", compiler_options=options)


def _jumped(jump: Jumps, now: HMCState, potential: Any, guide: Guide) -> HMCState:
    """An independence step of Metropolis and Hastings, proposed by the mixture.

    It keeps the posterior, as the trajectory after it does, and moves chains between modes
    that no path connects.
    """
    energy, gradient = jax.value_and_grad(potential)(jump.y)
    energy = jnp.where(jnp.isnan(energy), jnp.inf, energy)
    old = log_mixture(guide.mixture, (guide.factor @ now.z)[None])[0]
    log_ratio = now.potential_energy - energy + old - jump.log_proposal
    moved = now._replace(z=jump.y, z_grad=gradient, potential_energy=energy)
    accepted = (jump.log_uniform == -jnp.inf) | (jump.log_uniform < log_ratio)
    return jax.tree.map(lambda new, old: jnp.where(accepted, new, old), moved, now)


def sample_nuts(rng: np.random.Generator, target: Target, length: Length) -> Iterator[Chains]:
    """No-U-turn sampling (Hoffman and Gelman 2014), each draw after a proposed jump.

    Chains start from a weighted population of the posterior, whose mixture proposes the jumps.
    The metric comes from it too: the posterior's covariance, or the modes' average one where
    they are separate. Where the population is poor, both come from a first warm-up.

    Yields:
        `length.draws` more draws of each chain, without end.
    """
    found = explore(rng, target)
    start = resampled(rng, found, length.chains)
    poor = found.effective < POOR_EFFECTIVE
    factor = local_factor(found) if poor else spread_factor(found)
    guide = Guide(factor, found.mixture)
    blocks = _blocks(rng, target, guide, start, length.warmup)
    if poor:
        first = _take(blocks, length.warmup, [])
        x = ndtri(first.u[:, length.warmup // 2 :])
        guide = _mended(guide, x)
        blocks = _blocks(rng, target, guide, x[:, -1], length.warmup)
    left: list[Chains] = []
    _take(blocks, length.warmup, left)
    while True:
        yield _take(blocks, length.draws, left)


def _blocks(
    rng: np.random.Generator, target: Target, guide: Guide, start: np.ndarray, warmup: int
) -> Iterator[Chains]:
    """Blocks of draws from x [chain, d], the warm-up's among them, without end.

    Raises:
        ValueError: the log likelihood is NumPy's alone.
    """
    whitener = np.linalg.inv(guide.factor)

    def jumps(first: np.ndarray | None) -> Jumps:
        x = propose(guide.mixture, rng.normal(size=(BLOCK, d)), 1.0 - rng.random((BLOCK, UNIFORMS)))
        log_uniform = np.log(1.0 - rng.random(BLOCK))
        if first is not None:
            x[0], log_uniform[0] = first, -np.inf
        return Jumps(x @ whitener.T, log_mixture(guide.mixture, x), log_uniform)

    d = start.shape[1]
    seeds = rng.integers(2**31, size=len(start)).astype(np.uint32)
    run, likelihood = _compiled_run(), padded(target.log_likelihood)
    y = start @ whitener.T

    def block(starts: Sequence[np.ndarray | None]) -> Chains:
        made = []
        for i, first in enumerate(starts):
            last[i], drawn = run(last[i], likelihood, guide, jumps(first), warmup=warmup)
            made.append(jax.tree.map(np.asarray, drawn))
        x, stats = jax.tree.map(lambda *chains: np.stack(chains), *made)
        return Chains(ndtr(x), stats)

    with kept_compilations():  # later blocks compile nothing
        last = [_begin(*one, warmup=warmup) for one in zip(y, seeds, strict=True)]
        try:
            first = block(list(start))
        except (jax.errors.TracerArrayConversionError, jax.errors.ConcretizationTypeError) as error:
            raise ValueError(
                "'nuts' needs a surrogate whose log_likelihood takes arrays of JAX, too, as those "
                "with u.__array_namespace__() do; sample with 'emcee' or 'quadrature'"
            ) from error
    yield first
    while True:
        yield block([None] * len(start))


def padded(likelihood: Any) -> Any:
    """The same likelihood in arrays of few shapes, so that another number of simulations reuses the
    compiled program: its processes are padded, and what its own method `padded` pads. What is no
    named tuple of arrays is compiled anew for each fit."""

    def process(part: object) -> bool:
        return isinstance(part, GP)

    def pad(part: Any) -> Any:
        return padded_process(part) if process(part) else part

    if not isinstance(likelihood, tuple | jax.tree_util.Partial):
        return jax.tree_util.Partial(likelihood)
    own = getattr(likelihood, "padded", lambda: likelihood)
    return jax.tree.map(pad, own(), is_leaf=process)


def _take(blocks: Iterator[Chains], count: int, left: list[Chains]) -> Chains:
    """The next `count` draws; what remains of the last block goes to `left`."""
    parts, have = left[:], sum(part.u.shape[1] for part in left)
    while have < count:
        parts.append(next(blocks))
        have += parts[-1].u.shape[1]
    whole = jax.tree.map(lambda *arrays: np.concatenate(arrays, axis=1), *parts)
    left[:] = [jax.tree.map(lambda array: array[:, count:], whole)]
    return jax.tree.map(lambda array: array[:, :count], whole)


def spread_factor(found: Population) -> np.ndarray:
    """Cholesky factor [d, d] of the covariance; of the modes' average one, where they are so
    separate that one Gaussian describes the population far worse than the mixture."""
    weights, x = found.weights, found.x
    centred = x - weights @ x
    covariance = centred.T @ (centred * weights[:, None])
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, centred.T)
    constant = np.log(np.diag(factor)).sum() + 0.5 * x.shape[1] * np.log(2.0 * np.pi)
    gaussian = -0.5 * np.sum(white**2, axis=0) - constant
    used = weights > 0.0
    gain = weights[used] @ (found.log_proposal - gaussian)[used]
    return factor if gain < SEPARATE_MODES_GAIN else local_factor(found)


def local_factor(found: Population) -> np.ndarray:
    """Cholesky factor of the components' average covariance."""
    shares, factors = np.exp(found.mixture.log_share), found.mixture.factor
    return np.linalg.cholesky(np.einsum("k,kij,klj->il", shares, factors, factors))


def _mended(guide: Guide, x: np.ndarray) -> Guide:
    """Metric and mixture from warm-up draws x [chain, draw, d]."""
    flat = x.reshape(-1, x.shape[-1])
    rows = np.linspace(0, len(flat) - 1, REFITTED_DRAWS).astype(int)
    mixture = fit_mixture(flat[rows], np.zeros(REFITTED_DRAWS), 1.0)
    within = (x - x.mean(1, keepdims=True)).reshape(flat.shape)
    covariance = within.T @ within / len(within)
    floor = 1e-3 * guide.factor @ guide.factor.T
    return Guide(np.linalg.cholesky(covariance + floor), mixture)
