"""Draws from a posterior: one call for all samplers, which goes on until they suffice."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from . import quadrature
from .convergence import DIVERGENT_SHARE, ConvergenceStatus, diagnose, shortfall
from .ensemble import sample_emcee
from .nuts import sample_nuts
from .quadrature import sample_quadrature
from .target import Chains, Length, Target

Sampler = Callable[[np.random.Generator, Target, Length], Iterator[Chains]]
"""Yields `length.draws` more draws of each chain at each turn, without end."""

SAMPLERS: dict[str, Sampler] = {
    "nuts": sample_nuts,
    "emcee": sample_emcee,
    "quadrature": sample_quadrature,
}


class Sampled(NamedTuple):
    """Draws and what can be said of their quality."""

    chains: Chains
    steps: int  # draws per chain that were made; those kept are evenly spaced among them
    found: dict[ConvergenceStatus, str]  # what is wrong -> a sentence with its size and what to do
    checks: dict[str, float]  # results of the comparison with quadrature, where there was one

    @property
    def status(self) -> str:
        """ "converged", or all that is wrong, in sentences."""
        return " ".join(self.found.values()) or ConvergenceStatus.CONVERGED.value


def draw_posterior(
    sampler: str, target: Target, names: tuple[str, ...], length: Length, seed: int, extend: int
) -> Sampled:
    """Sample, go on while R-hat or ESS fall short, compare with quadrature, and say what came
    of it; see `Fit.sample`, whose arguments these are.

    Args:
        sampler: One of SAMPLERS.
        target: What to sample.
        names: Of its parameters, for messages.
        length: As asked for.
        seed: Fixes everything.
        extend: Largest multiple of `length.draws` to make.
    """
    source = SAMPLERS[sampler](np.random.default_rng(seed), target, length)
    parts = [next(source)]
    while True:
        chains = thinned(parts)
        measures = {n: diagnose(chains.u[..., j]) for j, n in enumerate(names)}
        steps = len(parts) * length.draws
        short = shortfall(measures, length.chains, length.draws, steps)
        if not short or 2 * len(parts) > extend:
            break
        parts += [next(source) for _ in range(len(parts))]
    found = {ConvergenceStatus.TOO_FEW_DRAWS: short} if short else {}
    flags = [part.stats["diverging"] for part in parts if "diverging" in part.stats]
    divergent = float(np.mean(flags)) if flags else 0.0
    if divergent > DIVERGENT_SHARE:
        found[ConvergenceStatus.DIVERGENT] = (
            f"not converged: {divergent:.1%} of the transitions diverged, above "
            f"{DIVERGENT_SHARE:.0%}. {ConvergenceStatus.DIVERGENT}"
        )
    checks: dict[str, float] = {}
    if target.dimension in quadrature.FIRST_GRID and sampler != "quadrature":
        effective = min(min(m["ess_bulk"], m["ess_tail"]) for m in measures.values())
        checks, complaint = _cross_checked(chains.u, target, effective)
        if complaint:
            found[ConvergenceStatus.QUADRATURE_DIFFERS] = complaint
    return Sampled(chains, steps, found, checks)


def thinned(parts: list[Chains]) -> Chains:
    """All draws, thinned to as many as one part has."""
    every = len(parts)

    def together(arrays: list[np.ndarray]) -> np.ndarray:
        return np.concatenate(arrays, axis=1)[:, every - 1 :: every]

    stats = {name: together([part.stats[name] for part in parts]) for name in parts[0].stats}
    return Chains(together([part.u for part in parts]), stats)


def _cross_checked(u: np.ndarray, target: Target, effective: float) -> tuple[dict[str, float], str]:
    """Measures of the comparison with quadrature, and a complaint or ""."""
    flat = u.reshape(-1, u.shape[-1])
    limit = quadrature.largest_expected(min(effective, len(flat)))
    for budget in (quadrature.QUICK_BUDGET, quadrature.THOROUGH_BUDGET):
        cells = quadrature.integrate(target, budget)
        distance = quadrature.total_variation(flat, cells)
        if distance <= limit:
            break
    checks = {"quadrature_total_variation": distance, "quadrature_total_variation_limit": limit}
    if distance <= limit:
        return checks, ""
    complaint = (
        f"disagrees with quadrature: total variation {distance:.3f} over {quadrature.BINS} bins, "
        f"above {limit:.3f}. {ConvergenceStatus.QUADRATURE_DIFFERS}"
    )
    return checks, complaint
