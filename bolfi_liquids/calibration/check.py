"""Simulations that judge a calibration: what the posterior predicts, and how noisy it is."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inference.simulations import Keep
from ..progress import Advance, Simulate, silent
from ..run.simulations import simulate_kept
from ..seeds import Phase, simulation_seeds

PREDICTIVE_DRAWS = 8
THETA_STAR_REPLICATES = 4  # seeds at theta*, for the noise between seeds


class Check(NamedTuple):
    """Signals of simulations that the engine did not learn from."""

    predictive: NDArray[np.float64]  # (draws, T, planes) rad, each at a posterior draw
    replicates: NDArray[np.float64]  # (seeds, T, planes) rad, all at theta*
    seconds: float  # spent in the simulator [s]


def check_by_simulation(
    simulate: Simulate,
    draws: Mapping[str, NDArray],
    best: Mapping[str, float],
    seed: int,
    keep: Keep,
    *,
    advance: Advance = silent,
) -> Check:
    """Simulate at `draws` and, with several seeds, at `best`; all with fresh seeds.

    Args:
        simulate: The stirring simulator.
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
    predictive = simulate_kept(simulate, draws, seeds[0], keep, advance=advance)
    replicates = simulate_kept(simulate, at_best, seeds[1], keep, advance=advance)
    return Check(predictive.signals, replicates.signals, predictive.seconds + replicates.seconds)
