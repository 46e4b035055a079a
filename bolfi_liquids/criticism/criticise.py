"""From a calibration to the effect that its simulator lacks."""

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..calibration.baseline import CleanSource, open_clean, prior_warnings
from ..calibration.model_error import Clean, clean_residuals, model_error
from ..calibration.result import Calibration
from ..calibration.stirs import effects_of, held_out_noise, stir_experiment, with_model_error
from ..errors import Argument
from ..inputs.frame import recording_warnings
from ..inputs.open import Source, open_recordings
from ..inputs.pour_table import Pours, PourTable
from ..inputs.recording import Recording
from ..inputs.settings import CriticismSettings
from ..motions import FILE, keep_motion, stir_proposals
from ..progress import phases
from ..run.compute import open_compute
from ..run.given_pours import keep_pours
from ..run.run import Run, RunOrPath
from ..simulators import StirSimulator, stir_simulator
from .criticism_file import criticism_tree
from .inputs import Inputs, check_effects, open_inputs
from .pours import as_prior, pour_experiment, pour_proposals
from .result import Criticism
from .summary import CriticismSummary

if TYPE_CHECKING:
    from .. import inference
    from ..inference.criticism import AutoregressiveNoise, Report
    from ..inference.simulations import Compute, Workers
    from ..models import Cups

logger = logging.getLogger(__name__)


def criticise(  # noqa: PLR0913  the one call that most users make
    calibration: RunOrPath,
    *,
    held_out: Source | Sequence[Source] = (),
    baseline: CleanSource | Sequence[CleanSource] = (),
    pours: Pours | None = None,
    held_out_pours: Pours | None = None,
    cups: "Cups | str | Path | None" = None,
    effects: str | Sequence[str] | None = None,
    accept: str | Sequence[str] | None = None,
    seed: int = 0,
    batch: int = CriticismSettings.batch,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Criticism:
    """Find where a calibrated simulator and the data disagree, and which effect it lacks.

    Everything that is simulated is kept in the run, so that an interrupted call, repeated,
    simulates nothing again; the same call on a criticised run only opens it.

    Args:
        calibration: Of the stirs, or its RUN directory.
        held_out: Recordings of the same liquid and rig by another path or speed. They are not
            fitted, and an effect that is named must hold on them.
        baseline: Clean recordings of the same rig, of any liquid, in which no effect is believed
            to be missing, and files of `learn_baseline`: they show what error the simulator
            makes on this rig. Without them it is the one that is known, see
            `models.stirring_error`.
        pours: A table of pours of the liquid, or its path; a second source. `choose_pour` uses
            them in any case.
        held_out_pours: Another, to which nothing is fitted.
        cups: With which they were poured, or a TOML file of them; None takes the bundled ones.
        effects: Names in `models.EFFECTS` to consider; None is all of them.
        accept: Effects that join the model whatever the verdict.
        seed: Seed of all random draws.
        batch: Simulations in one call, where there is no executor.
        executor, timeout: See `calibrate`.
        progress: Whether to show phases on stderr.

    Raises:
        InputError, ValueError: Something given cannot be used, the run is of another model, or
            another command works in it.
        ImportError, ConnectionError: `executor` cannot be used.
        RuntimeError: Simulations failed; the message says how.
    """
    started = time.perf_counter()
    # their rules make them tuples
    named: dict[str, Any] = {"effects": effects, "accept": accept}
    settings = CriticismSettings(**named, seed=seed, batch=batch)
    check_effects(settings, ("stir",) if pours is None else ("stir", "pour"))
    kept_back = open_recordings(held_out, Argument("held_out"))
    clean = open_clean(baseline)
    with Run.entered(calibration) as run:
        base = Calibration.of(run)
        poured = pours, held_out_pours
        inputs = open_inputs(base, settings, kept_back, clean, poured, cups)
        warnings = recording_warnings(inputs.compared) + prior_warnings(clean, base.prior)
        for notice in warnings:
            logger.warning(notice)
        for name in inputs.left_out:
            logger.warning("baseline %s: is criticised or held out, so it is not counted", name)
        with open_compute(executor, timeout) as compute:
            if inputs.table is not None:
                keep_pours(run.path, inputs.table, inputs.cups)
            if (finished := Criticism.of(run)) and finished.made_from == inputs.made_from:
                run.write_summary()
                keep_motion(run.path / FILE, finished.summary.next_motion)
                return finished
            with run.bank() as bank, phases(shown=progress) as report:
                own = replace(compute, batch=settings.batch, bank=bank)
                found, clean_runs = _find(base, inputs, own, report)
                tree = criticism_tree(inputs, found)
        seconds = time.perf_counter() - started
        summary = CriticismSummary.of(inputs, found, clean_runs, tree, seconds)
        run.keep("criticise", tree, inputs.made_from, summary.to_json())
        keep_motion(run.path / FILE, summary.next_motion)
        return Criticism.made(base, tree)


def _find(
    calibration: Calibration, inputs: Inputs, compute: "Compute", report: "Report"
) -> "tuple[dict[str, inference.criticism.Criticism], int]":
    """Criticism of each source, and the number of simulations of clean recordings before."""
    particles = inputs.stirring.setups[0].particles
    clean = clean_residuals(
        inputs.clean, particles, calibration.prior, compute=compute, report=report
    )
    how: dict[str, Any] = {
        "executor": compute.executor,
        "timeout": compute.timeout,
        "batch": compute.batch,
        "bank": compute.bank,
        "seed": inputs.settings.seed,
        "level": inputs.level,
    }
    found = {"stirs": _stirs(calibration, inputs, clean, how | {"report": report})}
    if inputs.table is not None:
        how["report"] = lambda phase, *counts: report(f"pours, {phase}", *counts)
        found["pours"] = _pours(calibration.prior, found["stirs"], inputs, inputs.table, how)
    return found, sum(one.simulations for one in clean)


def _stirs(
    calibration: Calibration, inputs: Inputs, clean: Sequence[Clean], how: Mapping[str, Any]
) -> "inference.criticism.Criticism":
    """The engine's criticism of the stirs."""
    from .. import inference

    stirring, settings, cameras = inputs.stirring, inputs.settings, inputs.cameras
    extensions = effects_of("stir", settings.effects)
    viscosity = calibration.summary.best["viscosity"]

    def experiment(own: StirSimulator, noise: "AutoregressiveNoise", label: str):
        @cache
        def at(viscosity: float) -> "inference.criticism.Noise":
            return with_model_error(noise, model_error(own, viscosity, clean))

        made = stir_experiment(own, noise, model_error(own, viscosity, clean), label)
        return replace(
            made,
            identity=own.identity_with_effects,
            # as the error follows the viscosity, a model is judged by that of its own liquid
            noise_at=lambda theta: at(float(f"{theta['viscosity']:.2g}")),
        )

    def held_out(recording: Recording) -> "inference.criticism.Experiment":
        own = stir_simulator([recording], stirring.setups[0].particles)
        noise = held_out_noise(recording, stirring.recordings)
        return experiment(own, noise, recording.path.name)

    elsewhere = with_model_error(cameras, model_error(stirring, viscosity, clean, elsewhere=True))
    return inference.criticism.criticise(
        experiment(stirring, cameras, "stir"),
        calibration.prior,
        extensions,
        earlier=calibration.learned_from,
        held_out=[held_out(one) for one in inputs.held_out],
        proposals=[
            *stir_proposals(stirring, inputs.motions, elsewhere),
            *pour_proposals(inputs.cups, inputs.density)[:1],
        ],
        accept=_among(settings.accept, extensions),
        plan=settings.stir_plan,
        **how,
    )


def _pours(
    prior: "inference.Prior",
    stirs: "inference.criticism.Criticism",
    inputs: Inputs,
    table: PourTable,
    how: Mapping[str, Any],
) -> "inference.criticism.Criticism":
    """Criticise pours, with the posterior of the stirs as the prior."""
    from .. import inference

    cups, density, settings = inputs.cups, inputs.density, inputs.settings
    acting = effects_of("pour", settings.effects)
    known = stirs.extended or stirs.base.hypothesis
    poured_too = [name for name in stirs.accepted if name in acting]
    extensions = {name: one for name, one in acting.items() if name not in poured_too}
    taught = as_prior(stirs.posterior.theta, stirs.posterior.weights, known.fit.prior)
    names = (*prior.names, *poured_too)
    held_out = [one for one in (inputs.held_out_table,) if one is not None]
    return inference.criticism.criticise(
        pour_experiment(table, cups, density),
        inference.Prior({name: taught.distributions[name] for name in names}),
        extensions,
        held_out=[pour_experiment(one, cups, density) for one in held_out],
        proposals=pour_proposals(cups, density),
        accept=_among(settings.accept, extensions),
        plan=settings.pour_plan,
        **how,
    )


def _among(accept: Sequence[str] | None, extensions: Mapping[str, Any]) -> list[str] | None:
    """Effects to accept that can act here; None leaves it to the verdict."""
    here = [name for name in accept or () if name in extensions]
    return here or None
