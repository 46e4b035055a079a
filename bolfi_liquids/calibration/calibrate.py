"""From recordings to a posterior over the simulator's parameters."""

import logging
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any

from ..errors import Argument, InputError
from ..files import given_path
from ..inputs.frame import recording_warnings
from ..inputs.open import Source, open_recordings
from ..inputs.pour_table import Pours, table_and_cups
from ..inputs.prior import check_prior, default_prior, describe_prior, read_prior
from ..inputs.recording import Recording
from ..inputs.settings import (
    CalibrationSettings,
    CriticismSettings,
    Sampler,
    Surrogate,
)
from ..inputs.start import check_start
from ..progress import progress_bar
from ..run.compute import open_compute
from ..run.given_pours import keep_pours
from ..run.results import generations, versions
from ..run.run import RUN_TOML, Run
from ..simulators import StirSimulator, stir_simulator
from ..wording import spoken, with_unit
from .baseline import (
    Baseline,
    CleanSource,
    Part,
    open_clean,
    parts_of,
    prior_warnings,
    recording_of,
)
from .engine_fit import (
    PREDICTIVE_DRAWS,
    THETA_STAR_REPLICATES,
    confirmed,
    fit_recordings,
    results_tree,
)
from .model_error import (
    CLEAN_RUNS,
    check_beside,
    clean_residuals,
    model_error,
)
from .result import Calibration
from .stirs import camera_noise, sensor_noise, with_model_error
from .summary import CalibrationSummary
from .until import Goal, check_goal, usual_budget

if TYPE_CHECKING:
    from ..inference import Prior
    from ..inference.simulations import Compute, Workers
    from ..models import Cups

logger = logging.getLogger(__name__)

ENDS = "settings.budget", "settings.until", "simulator.pour"
"""Fields of run.toml that say nothing but when the search ends."""


def calibrate(  # noqa: PLR0913  the one call that most users make
    recordings: Source | Sequence[Source],
    *,
    out: str | Path | None = None,
    prior: "Prior | None" = None,
    baseline: CleanSource | Sequence[CleanSource] = (),
    pours: Pours | None = None,
    cups: "Cups | str | Path | None" = None,
    budget: int | None = None,
    until: Goal | None = None,
    seed: int = 0,
    surrogate: Surrogate = "signal",
    batch: int = 4,
    particles: int = 0,
    sampler: Sampler = "nuts",
    chains: int = 4,
    draws: int = 1000,
    resume: bool = False,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Calibration:
    """Learn a liquid's parameters from recordings of it being stirred.

    Everything is kept in `out` as it is finished, so an interrupted call can be repeated with
    `resume`: it gives the same result, and repeats no finished simulation. The same call on a
    finished run only opens it. With a larger budget, or another `until`, it goes on from there;
    what followed from fewer simulations does not count any more.

    Args:
        recordings: One or several of one liquid, opened or as paths. Their discrepancies are
            added up.
        out: The RUN directory; None is a new one among the computer's temporary files.
        prior: Over `viscosity` [Pa s] and `cohesion` [1]; None is `default_prior()`.
        baseline: Clean recordings of the same rig, of any liquid, in which no effect is believed
            to be missing: the simulator's error is learned from them, at eight more simulations
            each, or from the file of `learn_baseline`. Without them it is the one that is known,
            see `models.stirring_error`.
        pours: A table of pours of the liquid that were made, or its path: the posterior does not
            depend on it, but `choose_pour` does.
        cups: With which they were made, or a TOML file of them; None takes the bundled ones.
        budget: Simulations of the search; None is 20, or with `until` 60 at most. Eight more check
            it at draws of the posterior, eight further ones follow if they move it, and four
            measure the noise between seeds.
        until: What ends the search earlier, see `known`. After the start design it is looked at
            about every fifth simulation, at the end of a batch, and must be reached twice in a row
            by fits without warnings. Pours that this needs are simulated first, and kept in `out`.
        seed: Seed of all random draws.
        surrogate: "signal", which emulates the inclination itself and allows for an error of the
            simulator, or "discrepancy", the paper's, which does not.
        batch: Simulations that are asked, and run, at the same time.
        particles: Number of particles of the simulated liquid; 0: cells follow the stick.
        sampler: "nuts" or "emcee".
        chains: Number of the sampler's chains.
        draws: Number of draws that each chain keeps.
        resume: Whether `out` may hold a run of the same settings, but for a smaller budget or
            another `until`, to go on with. A run with `until` has a budget of 60 unless given.
        executor, timeout: Where simulations run: a pool of processes, a Dask client or the address
            of a Dask scheduler, whose workers have one thread each; None is this process. The
            result has the same bits. And seconds that one simulation may take; one that takes
            longer counts as failed. None sets no limit.
        progress: Whether to show bars on stderr.

    Raises:
        InputError: A recording, the prior, a setting, `timeout` or `out` cannot be used, or the
            budget is spent before `until` could end the search.
        ValueError, ImportError, ConnectionError: `executor` cannot be used.
        RuntimeError: Simulations failed; the message says how.
    """
    if budget is None:
        budget = usual_budget(until)
    settings = CalibrationSettings(
        budget=budget,
        until=getattr(until, "text", None),
        batch=batch,
        seed=seed,
        surrogate=surrogate,
        particles=particles,
        sampler=sampler,
        chains=chains,
        draws=draws,
    )
    opened = _open_all(recordings)
    table, made_with = table_and_cups(pours, cups)
    if prior is not None:
        check_prior(prior)
    stirring = stir_simulator(opened, settings.particles)
    given, clean = _open_clean(baseline, stirring, settings)
    path = (
        Path(mkdtemp(prefix="bolfi_liquids_")) if out is None else given_path(out, Argument("out"))
    )
    prior = _usual_prior(path, resume) if prior is None else prior
    check_goal(until, settings, len(prior))
    record = run_record(settings, prior, stirring, given, until)
    with (
        open_compute(executor, timeout) as compute,
        Run.begun(path, record, resume=resume, ends=ENDS) as run,
    ):
        run.keep_recordings(stirring.recordings)
        if table is not None:
            keep_pours(path, table, made_with)
            run.write_summary()
        for notice in (*recording_warnings(opened), *prior_warnings(given, prior)):
            logger.warning(notice)
        if run.result("calibrate") is None:
            _calibrate(run, until, stirring, clean, compute, progress)
        return Calibration.of(run)


def run_record(
    settings: CalibrationSettings,
    prior: "Prior",
    stirring: StirSimulator,
    given: Sequence[Recording | Baseline] = (),
    until: Goal | None = None,
) -> dict[str, Any]:
    """Content of run.toml: settings, inputs, versions; see `run.run.MUST_AGREE`."""
    baseline = {"baseline": [one.hash for one in given]} if given else {}
    chosen = {name: of for name, of in asdict(settings).items() if of is not None}
    scene = {} if until is None else until.scene
    return {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": {**chosen, "prior": describe_prior(prior)},
        "engine": {"version": generations()["engine"]},
        "simulator": {**stirring.settings, **scene},
        "inputs": {"sha256": [one.hash for one in stirring.recordings], **baseline},
        "files": {"recordings": [one.path.name for one in stirring.recordings]},
        "versions": versions(),
    }


def _calibrate(
    run: Run,
    until: Goal | None,
    stirring: StirSimulator,
    clean: Sequence[Part],
    compute: "Compute",
    progress: bool,
) -> None:
    """Search, confirm, judge, and keep the result in the run."""
    from ..inference import Until
    from ..inference.criticism import KnownNoise

    settings = run.settings
    cameras = KnownNoise(sensor_noise(stirring.observed))
    unknown = [one for one in clean if isinstance(one, Recording)]
    needed = settings.budget + CLEAN_RUNS * len(unknown)
    needed += PREDICTIVE_DRAWS + THETA_STAR_REPLICATES
    with run.bank() as bank, ExitStack() as stack:
        compute = replace(compute, batch=settings.batch, bank=bank)
        budget, known = settings.budget, None
        if until is not None:  # nothing is stirred before its pours are there
            known = until.learn(stirring, run.prior, compute, progress)
            budget = Until(until.tolerance, budget, known)
        # more are made where the first that confirm the posterior move it
        bound = "at most" if until else "at least"
        bar = progress_bar("simulating stirs", needed, shown=progress, bound=bound)
        advance = stack.enter_context(bar)
        error, noise = None, None
        # the paper's surrogate has no noise to which an error adds
        if settings.surrogate == "signal":
            # beside the largest error the search does not settle on one liquid too early
            error = model_error(stirring, 0.0)
            noise = with_model_error(cameras, error)
        fit = fit_recordings(
            stirring,
            stirring.observed,
            run.prior,
            compute,
            settings,
            budget=budget,
            confirm=0,
            warn=False,
            progress=advance,
            noise=noise,
        )
        searched = len(fit.history.theta)
        until_error = None if known is None else known(fit)
        logger.info(
            "posterior so far: %s",
            ", ".join(
                f"{spoken(name)} {with_unit(name, median)} (90 %: {low:.3g} to {high:.3g})"
                for name, (low, median, high) in fit.quantiles((0.05, 0.5, 0.95)).items()
            ),
        )
        if error is not None:
            learned = clean_residuals(  # criticise finds the same simulations
                clean,
                settings.particles,
                run.prior,
                compute=replace(compute, batch=CriticismSettings.batch),
                report=lambda _phase, finished, _total: advance(finished),
            )
            error = model_error(stirring, fit.best["viscosity"], learned)
            noise = with_model_error(cameras, error)
        fit = confirmed(fit, noise, stirring, compute, settings, advance)
        sampled = fit.sample(
            settings.sampler, chains=settings.chains, draws=settings.draws, seed=settings.seed
        )
        tree = results_tree(sampled, fit, stirring, settings.seed, compute, advance)
    names = tuple(recording_of(one).path.name for one in clean)
    summary = CalibrationSummary.from_fit(tree, fit, stirring, searched, error, names)
    summary = replace(summary, until_error=until_error)
    run.keep("calibrate", tree, run.made_from, summary.to_json())


def _usual_prior(path: Path, resume: bool) -> "Prior":
    """Prior of a run that goes on, or else the default."""
    begun = resume and (path / RUN_TOML).exists()
    settings = Run.open(path).record.get("settings", {}) if begun else {}
    return read_prior(settings["prior"]) if "prior" in settings else default_prior()


def _open_all(recordings: Source | Sequence[Source]) -> list[Recording]:
    """Recordings of one liquid, each once."""
    opened = open_recordings(recordings)
    if not opened:
        raise InputError("no recording given", where="recordings", fix="give at least one")
    for recording in opened:
        check_start(recording)  # of one that was made or cut in Python, too
    if len({recording.hash for recording in opened}) < len(opened):
        names = ", ".join(str(recording.path) for recording in opened)
        raise InputError("the same recording twice", where=names, fix="give each of them once")
    return opened


def _open_clean(
    baseline: CleanSource | Sequence[CleanSource],
    stirring: StirSimulator,
    settings: CalibrationSettings,
) -> tuple[list[Recording | Baseline], list[Part]]:
    """What was given as clean, and the recordings in it beside which a run's can be calibrated."""
    given = open_clean(baseline)
    if given and settings.surrogate != "signal":
        raise InputError(
            f"clean recordings, but the surrogate {settings.surrogate!r} allows for no error",
            where=Argument("baseline"),
            fix="leave them out, or take the surrogate 'signal'",
        )
    alone = [one for one in given if isinstance(one, Recording)]
    check_beside(stirring, alone, "baseline")
    for recording in alone:
        camera_noise([recording])  # refuses one that rests too shortly
    # the file of a rig may hold what is calibrated
    clean, _ = parts_of(given, stirring.recordings, settings.particles)
    check_beside(stirring, list(map(recording_of, clean)), "baseline")
    return given, clean
