"""What is known of a liquid while it is stirred: pure functions of data and simulations so far.

Every simulation is of the whole plan and made once. After a stroke, what was observed is NaN from
there on, so that the discrepancy is the paper's integral up to that time,
Delta(t) = int_0^t (y - y~)^2 dt.
"""

import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..calibration.engine_fit import quick_draws
from ..calibration.stirs import rms, sensor_noise
from ..calibration.summary import BAD_FIT_RATIO, MIN_NOISE_DEG, ParameterSummary, unexplained
from ..inputs.frame import frame_faults
from ..inputs.settings import MIN_SIMULATIONS, PAPER_RULES
from ..models import stirring_error
from ..pouring.landing_map import LandingMap
from ..seeds import Phase, simulation_seeds
from ..simulators import StirSimulator
from .plan import Aligned, PartialRecording, align, stroke_ends
from .settings import OnlineSettings

if TYPE_CHECKING:
    from ..inference import Bolfi, Prior
    from ..inference.simulations import Job, Simulation


class OnlineEstimate(NamedTuple):
    """Estimate after a stroke.

    Attributes:
        strokes: Finished.
        covered: Time of the plan up to which data were used [s].
        parameters: Name -> posterior, in the parameter's own unit.
        action: Best pour, `angular_velocity` [rad/s] and `distance` [m].
        expected_spillage: Mean spilled fraction of that pour over the posterior.
        spillage_q95: Spilled fraction that one such pour in twenty exceeds.
        simulations: That the engine has learned from.
        lag: From the end of the stroke until this was known [s].
        delay: Of the arm behind its plan [s].
        apart: Greatest distance of the arm from its plan [m].
        complaints: Of the engine's own checks.
        fit_to_noise: Difference between data and closest simulation, in units of the noise, see
            `fit_to_noise`.
        frame_faults: What is wrong with the frame of the data; see `inputs.frame`.
    """

    strokes: int
    covered: float
    parameters: dict[str, ParameterSummary]
    action: dict[str, float]
    expected_spillage: float
    spillage_q95: float
    simulations: int
    lag: float
    delay: float
    apart: float
    complaints: tuple[str, ...]
    fit_to_noise: float = 0.0
    frame_faults: tuple[str, ...] = ()

    def as_record(self) -> dict[str, Any]:
        """As `online.jsonl` has it."""
        parameters = {name: asdict(spread) for name, spread in self.parameters.items()}
        return self._asdict() | {"parameters": parameters}

    @property
    def fits(self) -> bool:
        """Whether the data so far are near enough to a simulation, as `calibrate` asks it."""
        return self.fit_to_noise < BAD_FIT_RATIO and not self.frame_faults

    def is_enough(self, settings: OnlineSettings) -> bool:
        """Whether the pour is known well enough for stirring to end; never by a bad fit."""
        enough_strokes = self.strokes >= settings.least_strokes
        return self.fits and enough_strokes and self.spillage_q95 < settings.target


Made = tuple[tuple["Job", "Simulation"], ...]
"""Finished simulations of the whole plan, failed ones included, in the order of their jobs."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Constants of a stir.

    Attributes:
        prior: Of the liquid.
        stirring: The planned stir.
        settings: Of the online calibration.
    """

    prior: "Prior"
    stirring: StirSimulator
    settings: OnlineSettings

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of one signal."""
        return self.stirring.observed.shape


class Answer(NamedTuple):
    """Answer to the data so far.

    Attributes:
        aligned: The data, if they tell more than those before.
        estimate: From them.
        refusal: Why they cannot be used; "" if they can.
    """

    aligned: Aligned | None = None
    estimate: OnlineEstimate | None = None
    refusal: str = ""


def design(problem: Problem) -> "list[Job]":
    """The simulations to make before the robot moves: all over the prior."""
    return proposals(problem, (), np.zeros(problem.shape), problem.settings.design)


def simulate_plan(stirring: StirSimulator, bank: Path, batch: int, jobs: "list[Job]") -> Made:
    """Simulate what a bank lacks of these jobs, and keep it there; loads no JAX.

    Args:
        stirring: Of the plan.
        bank: File of the simulation bank.
        batch: Simulations that are made together.
        jobs: What is wanted.
    """
    from ..inference import SimulationBank
    from ..inference.simulations import Compute, run_missing

    with SimulationBank(bank) as kept:
        compute = Compute(bank=kept, batch=batch)
        made = run_missing(stirring.batched, jobs, compute, identity=stirring.identity)
    return tuple(zip(jobs, made, strict=True))


def proposals(problem: Problem, made: Made, observed: NDArray, n: int) -> "list[Job]":
    """The simulations that the data so far make worth while.

    Args:
        problem: What stays the same.
        made: Simulations so far; without any, the points lie all over the prior.
        observed: Of `align`.
        n: How many.
    """
    from ..inference.simulations import jobs

    seed = search_seed = problem.settings.seed
    if made:  # the rule's own jitter must differ from one call to the next
        (search_seed,) = simulation_seeds(seed, Phase.ONLINE_SEARCH, 1, len(made))
    theta = _engine(problem, made, observed, search_seed).ask(n)
    return jobs(theta, simulation_seeds(seed, Phase.ONLINE_STIRS, len(made) + n)[len(made) :])


def answer(
    problem: Problem, made: Made, landing_map: LandingMap, known: int, so_far: PartialRecording
) -> Answer:
    """An estimate if another stroke is finished, or why the data cannot be used.

    Args:
        problem: What stays the same.
        made: Simulations so far.
        landing_map: Of the pour's cups.
        known: Finished strokes of the data before.
        so_far: The data.
    """
    (plan,) = problem.stirring.recordings
    aligned = align(plan, stroke_ends(plan), so_far)
    if aligned.refusal:  # later data may be used
        return Answer(refusal=aligned.refusal)
    if aligned.strokes <= known or not np.isfinite(aligned.observed).any():
        return Answer()
    later = float(so_far.time[-1]) - aligned.covered - aligned.delay
    try:
        found = estimate(problem, made, aligned, landing_map, so_far.ended - later)
    except ValueError as error:
        return Answer(aligned, refusal=str(error))
    return Answer(aligned, found)


def estimate(
    problem: Problem, made: Made, aligned: Aligned, landing_map: LandingMap, ended: float
) -> OnlineEstimate:
    """Posterior and best pour, given the data so far.

    Args:
        problem: What stays the same.
        made: Simulations so far.
        aligned: The data.
        landing_map: Of the pour's cups.
        ended: When the last finished stroke ended, by `time.monotonic` [s].

    Raises:
        ValueError: Fewer than three simulations succeeded, or nothing was seen.
    """
    from ..inference.sampling.convergence import ConvergenceStatus

    engine = _engine(problem, made, aligned.observed, problem.settings.seed)
    fit = engine.fit(warn=False)  # warnings are among the estimate's complaints
    (plan,) = problem.stirring.recordings
    posterior = quick_draws(fit, problem.settings.seed)
    status = str(posterior.attrs["status"])
    draws = {name: posterior[name].to_numpy().ravel() for name in problem.prior.names}
    pour = landing_map.best(draws)
    good = np.isfinite(fit.history.signals).all(axis=(1, 2))
    viscosity = fit.history.theta[:, problem.prior.names.index("viscosity")]
    return OnlineEstimate(
        strokes=aligned.strokes,
        covered=aligned.covered,
        parameters={name: ParameterSummary.of(posterior[name]) for name in draws},
        action=pour.action,
        expected_spillage=pour.expected_spillage,
        spillage_q95=pour.spillage_q95,
        simulations=engine.succeeded,
        lag=time.monotonic() - ended,
        delay=aligned.delay,
        apart=aligned.apart,
        complaints=(*fit.warnings, *([] if status == ConvergenceStatus.CONVERGED else [status])),
        fit_to_noise=fit_to_noise(aligned.observed, fit.history.signals[good], viscosity[good]),
        frame_faults=tuple(frame_faults(replace(plan, inclination=aligned.observed))),
    )


def fit_to_noise(observed: NDArray, signals: NDArray, viscosity: NDArray) -> float:
    """How far the closest simulation is from the data, in units of the noise, without what the
    simulator itself errs by.

    No simulation is repeated with another seed while the robot stirs. In place of their noise, the
    closest simulation's distance from its nearest neighbour is taken, which is no smaller: where
    few simulations were made, a bad fit is not told from an unfinished search yet.

    Args:
        observed: Inclination [rad], shape (T, 2), NaN where missing.
        signals: Simulations [rad], shape (n, T, 2), n > 1.
        viscosity: Of the simulations [Pa s], shape (n,).
    """
    misfits = [rms(observed - one) for one in signals]
    closest = int(np.argmin(misfits))
    seen = np.isfinite(observed)
    others = np.delete(signals, closest, axis=0)
    apart = min(rms((one - signals[closest])[seen]) for one in others)
    noise = float(np.hypot(sensor_noise(observed), apart))
    left = unexplained(misfits[closest], stirring_error(viscosity[closest]))
    return left / max(noise, float(np.radians(MIN_NOISE_DEG)))


def _engine(problem: Problem, made: Made, observed: NDArray, seed: int) -> "Bolfi":
    """The engine with the simulations so far."""
    from ..inference import Bolfi
    from ..inference.simulations import columns, stacked

    paper: dict[str, Any] = PAPER_RULES
    engine = Bolfi(
        problem.prior,
        observed,
        surrogate="discrepancy",
        seed=seed,
        initial=MIN_SIMULATIONS,
        discrepancy=problem.stirring.discrepancy(),
        **paper,
    )
    if made:
        theta, seeds = columns([job for job, _ in made])
        engine.tell(theta, stacked([result for _, result in made], problem.shape), seeds)
    return engine
