"""The next stir that tells most of the liquid, of a run whose model is settled."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .calibration.model_error import model_error
from .calibration.stirs import camera_noise, sensor_noise, stir_experiment, with_model_error
from .calibration.summary import bad_fit
from .criticism.result import calibration_to_pour
from .inputs.settings import CriticismSettings
from .motions import Motion, family, keep_motion, planned, proposed
from .progress import phases
from .run.compute import open_compute
from .run.run import Run, RunOrPath
from .seeds import Phase, generator
from .simulators import StirSimulator, stir_simulator

if TYPE_CHECKING:
    from .inference.criticism import Proposal
    from .inference.criticism.design import Rival
    from .inference.criticism.study import Study
    from .inference.simulations import Workers

logger = logging.getLogger(__name__)

FILE = "design_stir.toml"
"""In RUN, by `design_stir`."""

MOTIONS = 8
"""That are considered, beside the first recording's own."""

AGAIN = "the same stir again"

MIN_RATIO = 1.5
"""Of the two viscosities that an experiment must tell apart: simulations of nearer ones differ by
little more than their noise."""


@dataclass(frozen=True)
class NextStir:
    """A stir, and what it is expected to tell.

    Attributes:
        label: What to do.
        cost: Its duration [s].
        sd_before, sd_after: Of the log of the viscosity, now and expected after it. The simulator's
            errors in the new stir count as independent of those in earlier ones.
        motion: RUN/design_stir.toml; None where the same stir again is best, for a recording does
            not hold its plan.
    """

    label: str
    cost: float
    sd_before: float
    sd_after: float
    motion: Path | None


def design_stir(
    calibration: RunOrPath,
    *,
    seed: int = 0,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> NextStir:
    """Find the stir that tells most of the liquid's viscosity; a new motion is kept in the run.

    Args:
        calibration: Of stirs, or its RUN directory; effects that a criticism accepted count. A bad
            fit is warned of.
        seed: Of all random draws.
        executor, timeout: See `calibrate`.
        progress: Whether to show phases on stderr.

    Raises:
        InputError: There is no such run, or another command works in it.
        RuntimeError: No stir of the family could be simulated.
    """
    from .inference.criticism.design import remaining_sd, suggest
    from .inference.criticism.study import Study

    with Run.entered(calibration) as run, open_compute(executor, timeout) as compute:
        known = calibration_to_pour(run)
        if (bad := bad_fit(known.summary)) is not None:
            logger.warning("%s: %s", run.path, bad)
        posterior = {str(k): np.ravel(v) for k, v in known.posterior.data_vars.items()}
        particles = int(known.record["settings"]["particles"])
        stirring = stir_simulator(run.recordings[:1], particles)
        motions = family(stirring, MOTIONS)
        middle = {name: float(np.median(of)) for name, of in posterior.items()}
        sd = float(np.std(np.log(posterior["viscosity"])))
        apart = max(2.0 * sd, float(np.log(MIN_RATIO)))
        with run.bank() as bank, phases(shown=progress) as report:
            own = replace(compute, batch=CriticismSettings.batch, bank=bank)
            fitted = stir_experiment(stirring, camera_noise(run.recordings), None, "stir")
            study = Study(fitted, run.prior, {}, own, seed=seed, report=report)
            proposals = list(_proposals(study, stirring, motions, middle))
            found, not_made = suggest(study, proposals, _rivals(posterior, middle, apart, seed))
        if not found:
            why = next(iter(not_made.values()), "each failed at the medians of the posterior")
            raise RuntimeError(f"{run.path}: no proposed stir could be simulated; {why}")
        best = found[0]
        motion = {one.label: asdict(one) for one in motions}.get(best.label)
        keep_motion(run.path / FILE, motion)
    after = sd * remaining_sd(best.snr, apart / sd)
    return NextStir(best.label, best.cost, sd, after, run.path / FILE if motion else None)


def _proposals(
    study: "Study", stirring: StirSimulator, motions: Sequence[Motion], theta: Mapping[str, float]
) -> "Iterator[Proposal]":
    """The recorded stir again, and the motions, but for those that cannot be simulated at theta.

    The simulator errs as the stick swings, so each is simulated once to see how it does.
    """
    from .inference.criticism import KnownNoise

    at = {name: np.array([value]) for name, value in theta.items()}
    noise = KnownNoise(sensor_noise(stirring.observed))
    plans = {AGAIN: stirring} | {motion.label: planned(stirring, motion) for motion in motions}
    for label, plan in plans.items():
        proposal = proposed(plan, label, noise)
        (made,) = study.run_each("response", [at], proposal)
        for signal in made.signals:
            swung = replace(plan.recordings[0], inclination=signal)
            error = model_error(StirSimulator((swung,), plan.setups), theta["viscosity"])
            yield replace(proposal, noise=with_model_error(noise, error))


def _rivals(
    posterior: Mapping[str, np.ndarray], middle: Mapping[str, float], apart: float, seed: int
) -> "dict[str, Rival]":
    """A thin and a thick liquid about the middle, so far apart in the viscosity's log; what else
    is unknown is as in the middle, then as drawn."""
    from .inference.criticism.design import RIVAL_DRAWS, Rival

    rng = generator(seed, Phase.POSTERIOR_DRAWS)
    rows = rng.integers(len(posterior["viscosity"]), size=RIVAL_DRAWS - 1)
    theta = {name: np.append(middle[name], of[rows]) for name, of in posterior.items()}
    same = np.ones(RIVAL_DRAWS)
    thin, thick = (
        theta | {"viscosity": middle["viscosity"] * np.exp(side * apart / 2.0) * same}
        for side in (-1.0, 1.0)
    )
    return {"thin": Rival(thin, 0.5), "thick": Rival(thick, 0.5)}
