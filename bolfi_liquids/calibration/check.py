"""Simulations that judge a calibration: what the posterior predicts, and how noisy it is."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inference.simulations import Compute
from ..progress import Advance, silent
from ..run.simulations import simulate_kept
from ..seeds import Phase, simulation_seeds
from ..simulators import StirSimulator

if TYPE_CHECKING:
    from ..inference.result import Closest, Fit

PREDICTIVE_DRAWS = 8
THETA_STAR_REPLICATES = 4  # seeds at theta*, for the noise between seeds


class PosteriorCheck(NamedTuple):
    """Signals of the simulations that judge a calibration.

    `closest` of them judges the fit, not the closest of the search: among few of these none may be
    near, though the posterior is right.
    """

    closest: "Closest"  # of those at posterior draws
    predictive: NDArray[np.float64]  # (draws, T, planes) rad, at draws, half where it is wide
    replicates: NDArray[np.float64]  # (seeds, T, planes) rad, all at theta*
    seconds: float  # spent in the simulator at theta* [s]


def check_of(
    fit: "Fit", stirring: StirSimulator, seed: int, compute: Compute, *, advance: Advance = silent
) -> PosteriorCheck:
    """Collect the runs at draws of a posterior, and simulate theta*.

    Args:
        fit: Of the engine, with runs that confirm it or not.
        stirring: The simulator, and what was recorded.
        seed: Of the run.
        compute: Where simulations are made and kept.
        advance: Called with 1 for each simulation.

    Raises:
        RuntimeError: Every simulation at a posterior draw failed, or every one at theta*.
    """
    drawn = fit.confirming
    good = drawn[fit.history.succeeded[drawn]]
    if not good.size:
        raise RuntimeError(
            f"all {len(drawn)} simulations at draws of the posterior failed, the first:"
            f" {fit.history.errors[drawn[0]]}; repeat the call with a larger budget"
        )
    at_best = {name: np.full(THETA_STAR_REPLICATES, value) for name, value in fit.best.items()}
    seeds = simulation_seeds(seed, Phase.REPLICATES, THETA_STAR_REPLICATES)
    replicates = simulate_kept(stirring, at_best, seeds, compute, advance=advance)
    return PosteriorCheck(
        _closest(stirring, fit, good),
        fit.history.signals[good],
        replicates.signals,
        replicates.seconds,
    )


def _closest(stirring: StirSimulator, fit: "Fit", runs: NDArray[np.int64]) -> "Closest":
    """The one of these runs that comes nearest to what was recorded."""
    from ..inference.result import Closest

    distance, history = stirring.discrepancy(), fit.history
    discrepancies = [distance(stirring.observed, history.signal(run)) for run in runs]
    at = int(np.argmin(discrepancies))
    theta = fit.prior.to_dict(history.theta[runs[at]])
    return Closest(
        {name: float(value) for name, value in theta.items()},
        history.signal(runs[at]),
        discrepancies[at],
    )
