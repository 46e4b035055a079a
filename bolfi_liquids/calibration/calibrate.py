"""From recordings to a posterior over the simulator's parameters."""

import sys
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ..errors import InputError
from ..inputs.open import Source, open_recordings
from ..inputs.prior import check_prior, default_prior, describe_prior
from ..inputs.recording import Recording
from ..inputs.settings import MIN_SIMULATIONS, PAPER_RULES, CalibrationSettings
from ..progress import Simulate, progress_bar, reported
from ..run.directory import (
    POSTERIOR,
    enter_run,
    open_bank,
    read_run,
)
from ..run.provenance import LIBRARIES, versions
from ..run.recordings import keep_recordings
from .draws import pick_draws
from .result import Calibration, is_calibrated
from .stir_simulator import Stirring, stirring_of
from .summary import CalibrationSummary

if TYPE_CHECKING:
    from ..inference import Fit, Prior, SimulationBank
    from ..run.simulations import Keep


def calibrate(  # noqa: PLR0913  the one call that most users make
    recordings: Source | Sequence[Source],
    *,
    out: str | Path,
    prior: "Prior | None" = None,
    budget: int = 20,
    seed: int = 0,
    surrogate: str = "discrepancy",
    batch: int = 4,
    particles: int = 1000,
    sampler: str = "nuts",
    chains: int = 4,
    draws: int = 1000,
    resume: bool = False,
    progress: bool = True,
) -> Calibration:
    """Learn a liquid's parameters from recordings of it being stirred.

    Everything is kept in `out` as it is finished, so an interrupted call can be repeated with
    `resume`: it then concludes exactly what it would have concluded, and repeats no finished
    simulation. The same call on a finished run only opens it. With a larger budget it goes on from
    there, and removes what was concluded from fewer simulations.

    Args:
        recordings: One or several of one liquid, opened or as paths. Their discrepancies are
            added up.
        out: The RUN directory.
        prior: Over `viscosity` [Pa s] and `cohesion` [1]; None is `default_prior()`.
        budget: Simulations that the engine may learn from. A dozen more judge the result, anew
            where a run grew.
        seed: Of all random draws.
        surrogate: "discrepancy", the paper's, or "signal", which emulates the inclination itself.
        batch: Simulations run at the same time.
        particles: Of the simulated liquid.
        sampler: "nuts" or "emcee".
        chains: Of the sampler.
        draws: Kept, for each chain.
        resume: Whether `out` may hold a run of the same settings, but for a smaller budget, to go
            on with.
        progress: Whether to show bars on stderr.

    Raises:
        InputError: A recording, the prior, a setting or `out` cannot be used.
        RuntimeError: Simulations failed; the message says how.
    """
    settings = CalibrationSettings(
        budget=budget,
        batch=batch,
        seed=seed,
        surrogate=surrogate,
        particles=particles,
        sampler=sampler,
        chains=chains,
        draws=draws,
    )
    opened = _open_all(recordings)
    prior = default_prior() if prior is None else prior
    check_prior(prior)
    stirring = stirring_of(opened, particles)
    run = Path(out)
    record = run_record(settings, prior, stirring)
    removed = enter_run(run, record, resume=resume, growing="settings.budget")
    if removed and progress:
        what = f"removed {', '.join(removed)}, concluded from fewer simulations"
        print(f"{run}: {what}; every simulation is kept", file=sys.stderr)
    keep_recordings(run, stirring.recordings)
    if not is_calibrated(run):
        _calibrate(run, stirring, prior, settings, progress)
    return Calibration.open(run)


def run_record(settings: CalibrationSettings, prior: "Prior", stirring: Stirring) -> dict[str, Any]:
    """Content of run.toml: settings, inputs, versions; see `run.directory.MUST_AGREE`."""
    from ..inference.engine_version import ENGINE_VERSION

    return {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": asdict(settings) | {"prior": describe_prior(prior)},
        "engine": {"version": ENGINE_VERSION},
        "simulator": stirring.settings,
        "inputs": {"sha256": [recording.hash for recording in stirring.recordings]},
        "files": {"recordings": [recording.path.name for recording in stirring.recordings]},
        "versions": versions(LIBRARIES),
    }


def _calibrate(
    run: Path, stirring: Stirring, prior: "Prior", settings: CalibrationSettings, progress: bool
) -> None:
    from ..run.simulations import Keep
    from .check import PREDICTIVE_DRAWS, check_by_simulation
    from .tree import results_tree, write_tree

    with (
        open_bank(run) as bank,
        progress_bar("simulating stirs", _left(run, settings, bank), shown=progress) as advance,
    ):
        simulate = reported(stirring.simulate, advance)
        keep = Keep(bank, stirring.identity, settings.batch)
        fit = fit_recordings(
            stirring,
            stirring.observed,
            prior,
            keep,
            budget=settings.budget,
            surrogate=settings.surrogate,
            seed=settings.seed,
            simulate=simulate,
        )
        sampled = fit.sample(
            settings.sampler, chains=settings.chains, draws=settings.draws, seed=settings.seed
        )
        drawn = pick_draws(sampled["posterior"].to_dataset(), PREDICTIVE_DRAWS, settings.seed)
        check = check_by_simulation(simulate, drawn, fit.best, settings.seed, keep)
    tree = results_tree(sampled, fit, stirring, check)
    if (now := read_run(run)["settings"]["budget"]) != settings.budget:
        raise InputError(
            f"another call has made its budget {now} meanwhile",
            where=str(run),
            fix="nothing was written; go on with that budget and --resume",
        )
    write_tree(tree, run / POSTERIOR)
    CalibrationSummary.from_fit(tree, fit, stirring, check).write(run)


def _left(run: Path, settings: CalibrationSettings, bank: "SimulationBank") -> int:
    """Simulations that a run still needs; some of those before it grew were judging, or pours."""
    from .check import PREDICTIVE_DRAWS, REPLICATES

    before = read_run(run).get("grown", [{"learned_from": 0, "simulations": 0}])[-1]
    needed = settings.budget - before["learned_from"] + PREDICTIVE_DRAWS + REPLICATES
    return needed - (len(bank) - before["simulations"])


def fit_recordings(  # noqa: PLR0913  what a calibration is made of
    stirring: Stirring,
    observed: NDArray,
    prior: "Prior",
    keep: "Keep",
    *,
    budget: int,
    surrogate: str,
    seed: int,
    simulate: Simulate | None = None,
    warn: bool = True,
) -> "Fit":
    """The engine's fit of a stir, with the options that go with the surrogate.

    Args:
        stirring: The simulator, and how two signals are compared.
        observed: Inclinations (T, 2) [rad], NaN where missing.
        prior: Of the parameters.
        keep: Finished simulations are taken from there and put there.
        budget: Simulations to learn from.
        surrogate: One of `settings.SURROGATES`.
        seed: Of all random draws.
        simulate: In place of the stirring's own, such as one that reports.
        warn: Whether the emulator's complaints are raised as warnings.
    """
    from .. import inference

    options = engine_options(stirring, surrogate)
    if "initial" in options:
        options["initial"] = min(options["initial"], budget)
    return inference.fit(
        simulate or stirring.simulate,
        prior,
        observed,
        budget=budget,
        batch=keep.batch,
        seed=seed,
        bank=keep.bank,
        identity=keep.identity,
        warn=warn,
        progress=False,
        **options,
    )


def engine_options(stirring: Stirring, surrogate: str) -> dict[str, Any]:
    """Options of `inference.Bolfi` that go with one of `settings.SURROGATES`."""
    paper = {**PAPER_RULES, "initial": MIN_SIMULATIONS}
    return {
        "surrogate": surrogate,
        "discrepancy": stirring.discrepancy(),
        **(paper if surrogate == "discrepancy" else {}),
    }


def _open_all(recordings: Source | Sequence[Source]) -> list[Recording]:
    opened = open_recordings(recordings)
    if not opened:
        raise InputError("no recording given", where="recordings", fix="give at least one")
    if len({recording.hash for recording in opened}) < len(opened):
        names = ", ".join(str(recording.path) for recording in opened)
        raise InputError("the same recording twice", where=names, fix="give each of them once")
    return opened
