"""Simulations that judge a calibration: what the posterior predicts, and how noisy it is."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inference.simulations import Keep
from ..progress import Advance, silent
from ..run.simulations import simulate_kept
from ..seeds import Phase, simulation_seeds
from .stir_simulator import Stirring

if TYPE_CHECKING:
    from ..inference.result import Closest

PREDICTIVE_DRAWS = 8
THETA_STAR_REPLICATES = 4  # seeds at theta*, for the noise between seeds


class Check(NamedTuple):
    """Signals of simulations that the engine did not learn from.

    `closest` of them judges the fit, not the closest that was learned from: among few of these
    none may be near, though the posterior is right.
    """

    closest: "Closest"  # of those at posterior draws
    predictive: NDArray[np.float64]  # (draws, T, planes) rad, each at a posterior draw
    replicates: NDArray[np.float64]  # (seeds, T, planes) rad, all at theta*
    seconds: float  # spent in the simulator [s]


def check_by_simulation(
    stirring: Stirring,
    draws: Mapping[str, NDArray],
    best: Mapping[str, float],
    seed: int,
    keep: Keep,
    *,
    advance: Advance = silent,
) -> Check:
    """Simulate at `draws` and, with several seeds, at `best`; all with fresh seeds.

    Args:
        stirring: The simulator, and what was recorded.
        draws: Posterior draws, name -> shape (n,).
        best: theta*.
        seed: Of the run.
        keep: Where simulations are made and kept.
        advance: Called with 1 for each simulation.
    """
    count = len(next(iter(draws.values())))
    at_best = {name: np.full(THETA_STAR_REPLICATES, value) for name, value in best.items()}
    seeds = (
        simulation_seeds(seed, Phase.PREDICTIVE, count),
        simulation_seeds(seed, Phase.REPLICATES, THETA_STAR_REPLICATES),
    )
    predictive = simulate_kept(stirring.simulate, draws, seeds[0], keep, advance=advance)
    replicates = simulate_kept(stirring.simulate, at_best, seeds[1], keep, advance=advance)
    simulated = {name: values[predictive.places] for name, values in draws.items()}
    return Check(
        _closest(stirring, simulated, predictive.signals),
        predictive.signals,
        replicates.signals,
        predictive.seconds + replicates.seconds,
    )


def _closest(stirring: Stirring, theta: Mapping[str, NDArray], signals: NDArray) -> "Closest":
    """The one of n simulations that comes nearest to what was recorded."""
    from ..inference.result import Closest

    distance = stirring.discrepancy()
    discrepancies = [distance(stirring.observed, signal) for signal in signals]
    at = int(np.argmin(discrepancies))
    there = {name: float(values[at]) for name, values in theta.items()}
    return Closest(there, signals[at], discrepancies[at])
