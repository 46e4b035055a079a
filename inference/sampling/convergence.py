"""Have the chains converged, and if not, what is wrong and what to do."""

from collections.abc import Mapping
from enum import StrEnum

import numpy as np

from .._lazy import array_stats

RHAT_LIMIT = 1.01
ESS_PER_CHAIN = 100.0
DIVERGENT_SHARE = 0.01


class ConvergenceStatus(StrEnum):
    """Outcome of sampling; each text says how to mend it."""

    CONVERGED = "converged"
    TOO_FEW_DRAWS = (
        "Raise `draws` or `extend`, and look at the chains, for example with az.plot_trace."
    )
    DIVERGENT = (
        "The log likelihood is too steep somewhere: compare with sample('emcee'), and look where "
        "sample_stats.diverging is true, for example with az.plot_pair."
    )
    QUADRATURE_DIFFERS = (
        "A mode may be missed, or the posterior too narrow for the grid: compare with "
        "sample('quadrature')."
    )


class SamplingWarning(UserWarning):
    """The draws do not fulfil what the sampler promises; the message says which and why."""


MEASURES = {
    "rhat": "rank-normalised split R-hat",
    "ess_bulk": "bulk effective sample size",
    "ess_tail": "tail effective sample size",
}


def diagnose(draws: np.ndarray) -> dict[str, float]:
    """Rank-normalised split R-hat, bulk and tail ESS and Monte Carlo standard errors of draws
    [chain, draw] (Vehtari et al. 2021); errors in the units of the draws.

    Draws that do not vary at all have an infinite R-hat and no effective draws.
    """
    if np.ptp(draws) == 0.0:
        constant = {"rhat": np.inf, "ess_bulk": 0.0, "ess_tail": 0.0}
        return {**constant, "mcse_mean": 0.0, "mcse_q05": 0.0, "mcse_q95": 0.0}
    stats = array_stats()
    measures = {
        "rhat": stats.rhat(draws),
        "ess_bulk": stats.ess(draws, method="bulk"),
        "ess_tail": stats.ess(draws, method="tail", prob=(0.05, 0.95)),
        "mcse_mean": stats.mcse(draws, method="mean"),
        "mcse_q05": stats.mcse(draws, method="quantile", prob=0.05),
        "mcse_q95": stats.mcse(draws, method="quantile", prob=0.95),
    }
    return {name: np.asarray(value).item() for name, value in measures.items()}


def limits(chains: int, draws: int) -> tuple[float, float]:
    """Largest R-hat and smallest effective sample size that pass.

    1.01 and 100 per chain (Vehtari et al. 2021) from 1000 draws per chain on. With fewer, a
    tenth of the draws, and with fewer than 600 R-hat up to 1 + 6 / draws: independent draws
    exceed that in less than one of 400 cases (measured with 2 and 4 chains).
    """
    return max(RHAT_LIMIT, 1.0 + 6.0 / draws), chains * min(ESS_PER_CHAIN, draws / 10.0)


def shortfall(
    measures: Mapping[str, Mapping[str, float]], chains: int, draws: int, steps: int
) -> str:
    """Measures beyond their limits, NaN included, where they are worst; "" if there are none.

    Args:
        measures: Parameter -> as from `diagnose`.
        chains, draws: Of those that were measured.
        steps: Draws per chain that were made.
    """
    most, least = limits(chains, draws)
    parts = []
    for measure, meaning in MEASURES.items():
        high = measure == "rhat"
        sign, limit, side, digits = (1, most, "above", 3) if high else (-1, least, "below", 0)
        excess = {name: sign * (of[measure] - limit) for name, of in measures.items()}
        missed = [name for name, by in excess.items() if not by <= 0.0]
        if missed:
            worst = max(missed, key=excess.__getitem__)
            value = f"{measures[worst][measure]:.{digits}f}, {side} {limit:.{digits}f}"
            parts.append(f"{meaning} of {worst!r} is {value}")
    if not parts:
        return ""
    advice = ConvergenceStatus.TOO_FEW_DRAWS
    return f"not converged after {steps} draws per chain: {'; '.join(parts)}. {advice}"
