"""The engine's fit of recordings, and simulations that confirm and judge it."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inputs.settings import MIN_SIMULATIONS, PAPER_RULES, CalibrationSettings
from ..progress import Advance, silent
from ..run.simulations import simulate_kept
from ..seeds import Phase, simulation_seeds
from ..simulators import StirSimulator
from .model_error import ModelError, noise_beside

if TYPE_CHECKING:
    from ..inference import Fit, Prior
    from ..inference.result import Closest
    from ..inference.simulations import Compute

PREDICTIVE_DRAWS = 8
THETA_STAR_REPLICATES = 4  # seeds at theta*, for the noise between seeds


def fit_recordings(
    stirring: StirSimulator,
    observed: NDArray,
    prior: "Prior",
    compute: "Compute",
    settings: CalibrationSettings,
    **more: Any,
) -> "Fit":
    """The engine's fit of a stir, with the options that go with the surrogate.

    Args:
        stirring: The simulator, and how two signals are compared.
        observed: Inclinations (T, 2) [rad], NaN where missing.
        prior: Prior of the parameters.
        compute: Where simulations are made and kept.
        settings: Budget, surrogate and seed.
        more: Other arguments of `inference.fit`, and `budget` in place of the settings'; without
            `progress` no bar is shown.
    """
    from .. import inference

    options = engine_options(stirring, settings.surrogate)
    if "initial" in options:
        options["initial"] = min(options["initial"], settings.budget)
    return inference.fit(
        stirring.batched,
        prior,
        observed,
        batch=settings.batch,
        seed=settings.seed,
        executor=compute.executor,
        in_rounds=True,
        bank=":memory:" if compute.bank is None else compute.bank,
        identity=stirring.identity,
        timeout=compute.timeout,
        **{"budget": settings.budget, "progress": False, **more},
        **options,
    )


def engine_options(stirring: StirSimulator, surrogate: str) -> dict[str, Any]:
    """Options of `inference.Bolfi` that go with one of `settings.SURROGATES`."""
    paper = {**PAPER_RULES, "initial": MIN_SIMULATIONS}
    return {
        "surrogate": surrogate,
        "discrepancy": stirring.discrepancy(),
        **(paper if surrogate == "discrepancy" else {}),
    }


def confirmed(
    fit: "Fit",
    error: ModelError | None,
    stirring: StirSimulator,
    compute: "Compute",
    settings: CalibrationSettings,
    advance: Advance,
) -> "Fit":
    """Refit beside the simulator's error, with runs at draws of the posterior.

    Args:
        fit: Of the search, beside another error.
        error: Of the simulator; None where the surrogate allows for none.
        stirring: What was simulated.
        compute: Where simulations are made and kept.
        settings: Of the run.
        advance: Called with 1 for each simulation.

    Warns:
        EmulatorWarning: For each complaint.
    """
    from ..inference.criticism import Experiment

    observed, search = fit.observed, fit.history
    theta = fit.prior.to_dict(search.theta)
    beside: dict[str, Any] = {}
    if error is not None:
        beside["noise"] = noise_beside(stirring, error)
        observed = Experiment(stirring.batched, observed, beside["noise"]).corrected
    made = fit_recordings(
        stirring,
        observed,
        fit.prior,
        compute,
        settings,
        budget=0,
        earlier=(theta, search.signals, search.seeds, search.why.tolist()),
        confirm=PREDICTIVE_DRAWS,
        progress=advance,
        **beside,
    )
    # the rounds that the search asked in, and what was recorded before it was corrected
    later = made.history.rounds[len(search.rounds) :] + search.rounds.max() + 1
    rounds = np.append(search.rounds, later)
    return replace(
        made,
        observed=fit.observed,
        history=made.history._replace(rounds=rounds),
        seconds={part: spent + made.seconds[part] for part, spent in fit.seconds.items()},
        made_by=None,  # of the corrected data
    )


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
    fit: "Fit", stirring: StirSimulator, seed: int, compute: "Compute", *, advance: Advance = silent
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
    from ..inference.result import Closest

    drawn = fit.confirming
    good = drawn[fit.history.succeeded[drawn]]
    if not good.size:
        raise RuntimeError(
            f"all {len(drawn)} simulations at draws of the posterior failed, the first:"
            f" {fit.history.errors[drawn[0]]}; repeat the call with a larger budget"
        )
    distance, history = stirring.discrepancy(), fit.history
    discrepancies = [distance(stirring.observed, history.signal(run)) for run in good]
    nearest = int(np.argmin(discrepancies))
    theta = fit.prior.to_dict(history.theta[good[nearest]])
    closest = Closest(
        {name: float(value) for name, value in theta.items()},
        history.signal(good[nearest]),
        discrepancies[nearest],
    )
    at_best = {name: np.full(THETA_STAR_REPLICATES, value) for name, value in fit.best.items()}
    seeds = simulation_seeds(seed, Phase.REPLICATES, THETA_STAR_REPLICATES)
    replicates = simulate_kept(stirring, at_best, seeds, compute, advance=advance)
    return PosteriorCheck(
        closest,
        fit.history.signals[good],
        replicates.signals,
        replicates.seconds,
    )
