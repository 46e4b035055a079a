"""From a calibration to what its simulator lacks."""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .calibration import Calibration
from .calibrator import Source
from .clean_recordings import Clean, clean_residuals, usual_for
from .criticism import Criticism
from .criticism_results import criticism_tree
from .criticism_section import criticism_section
from .cups import bundled_cups
from .errors import InputError
from .findings import Findings
from .pour_experiment import as_prior, pour_experiment
from .pour_table import PourTable, open_pours
from .prior import read_prior
from .progress import phases
from .proposals import pour_proposals, stir_proposals
from .recordings import Recording, open_recording
from .recordings_kept import kept_recordings
from .results import write_tree
from .run_directory import CRITICISM, open_bank
from .settings import CriticismSettings
from .stir_experiment import camera_noise, effects_of, stir_experiment
from .stirring import Stirring, stirring_of
from .summary import write_section

if TYPE_CHECKING:
    from . import inference
    from .models import Cups


def criticise(  # noqa: PLR0913  the one call that most users make
    calibration: Calibration | str | Path,
    *,
    held_out: Source | Sequence[Source] = (),
    baseline: Source | Sequence[Source] = (),
    pours: PourTable | str | Path | None = None,
    cups: "Cups | None" = None,
    effects: Sequence[str] | None = None,
    accept: Sequence[str] | None = None,
    seed: int = 0,
    progress: bool = True,
) -> Criticism:
    """Find where a calibrated simulator and the data disagree, and which effect it lacks.

    Everything that is simulated is kept in the run, so that an interrupted call, repeated,
    simulates nothing again.

    Args:
        calibration: Of the stirs, or its RUN directory.
        held_out: Recordings of the same liquid and rig by another path or speed, to which
            nothing is fitted: what is named must hold on them.
        baseline: Recordings of the same rig that are believed to lack nothing, of any liquid:
            they teach what the simulator usually gets wrong.
        pours: A table of pours of the liquid, or its path; a second source.
        cups: With which they were poured; None takes the bundled ones.
        effects: Names in `models.EFFECTS` to consider; None is all of them.
        accept: Effects that join the model whatever the verdict.
        seed: Of everything random.
        progress: Whether to show phases on stderr.

    Raises:
        InputError: Something given cannot be used.
        RuntimeError: Simulations failed; the message says how.
    """
    if not isinstance(calibration, Calibration):
        calibration = Calibration.open(calibration)
    started = time.perf_counter()
    settings = CriticismSettings(
        effects=None if effects is None else tuple(effects),
        accept=None if accept is None else tuple(accept),
        seed=seed,
    )
    run, record = calibration.path, calibration.record
    particles = int(record["settings"]["particles"])
    stirring = stirring_of(kept_recordings(run, dict(record)), particles)
    kept_back = _open(held_out)
    clean = _others(_open(baseline), [*stirring.recordings, *kept_back])
    _check_held_out(stirring, kept_back)
    table = open_pours(pours) if isinstance(pours, str | Path) else pours
    prior = read_prior(record["settings"]["prior"])
    with open_bank(run) as bank, phases(shown=progress) as report:
        from .inference import Keeping

        keeping = Keeping(bank, settings.batch, seed, report)
        usual = clean_residuals(
            clean, particles, prior, effects_of("stir"), settings.clean_plan, keeping
        )
        stirs = _stirs(calibration, stirring, kept_back, usual, settings, keeping)
        poured = None
        if table is not None:
            cups = bundled_cups() if cups is None else cups
            poured = _pours(calibration, stirs, table, cups, settings, keeping)
        findings = Findings(calibration, stirring, stirs, poured, table, tuple(clean), settings)
        tree = criticism_tree(findings)
    write_tree(tree, run / CRITICISM)
    section = criticism_section(findings, tree, time.perf_counter() - started)
    write_section(run, "criticise", section)
    return Criticism.open(run)


def _stirs(
    calibration: Calibration,
    stirring: Stirring,
    held_out: Sequence[Recording],
    clean: Sequence[Clean],
    settings: CriticismSettings,
    keeping: "inference.Keeping",
) -> "inference.Criticism":
    from . import inference

    particles = stirring.setups[0].particles
    kept_back = [stirring_of([recording], particles) for recording in held_out]
    extensions = effects_of("stir", settings.effects)
    if not extensions:
        raise InputError(
            "none of the effects acts in a stir",
            where="--effects",
            fix=f"choose from {', '.join(effects_of('stir'))}",
        )
    return inference.criticise(
        stir_experiment(stirring, usual_for(stirring, clean), "stir"),
        read_prior(calibration.record["settings"]["prior"]),
        extensions,
        earlier=_learned_from(calibration),
        held_out=[
            stir_experiment(one, usual_for(one, clean), one.recordings[0].path.name)
            for one in kept_back
        ],
        proposals=stir_proposals(stirring, camera_noise(stirring.recordings)),
        accept=_among(settings.accept, extensions),
        plan=settings.stir_plan,
        keeping=keeping,
    )


def _pours(
    calibration: Calibration,
    stirs: "inference.Criticism",
    table: PourTable,
    cups: "Cups",
    settings: CriticismSettings,
    keeping: "inference.Keeping",
) -> "inference.Criticism":
    """The same for pours, of a liquid of which the stirs are known to have taught something."""
    from . import inference

    density = calibration.liquid_density
    extensions = effects_of("pour", settings.effects)
    known = stirs.extended or stirs.base.hypothesis
    poured_too = [name for name in stirs.accepted if name in extensions]
    taught = as_prior(stirs.posterior.theta, stirs.posterior.weights, known.fit.prior)
    names = (*read_prior(calibration.record["settings"]["prior"]).names, *poured_too)
    base = inference.Prior({name: taught.distributions[name] for name in names})
    return inference.criticise(
        pour_experiment(table, cups, density),
        base,
        {name: one for name, one in extensions.items() if name not in poured_too},
        proposals=pour_proposals(cups, density),
        accept=_among(settings.accept, extensions),
        plan=settings.pour_plan,
        keeping=replace(keeping, report=lambda phase, n: keeping.report(f"pours, {phase}", n)),
    )


def _among(accept: Sequence[str] | None, extensions: dict) -> list[str] | None:
    """Of the effects to accept, those that can act here; None leaves it to the verdict."""
    here = [name for name in accept or () if name in extensions]
    return here or None


def _learned_from(calibration: Calibration):
    """The simulations that the calibration learned from: theta, signals, seeds."""
    made = calibration.tree["simulations"].to_dataset()
    good = ~made["failed"].to_numpy()
    theta = {
        str(name): made[name].to_numpy()[good] for name in calibration.tree["posterior"].data_vars
    }
    return theta, made["signal"].to_numpy()[good], made["seed"].to_numpy()[good]


def _open(sources: Source | Sequence[Source]) -> list[Recording]:
    listed = [sources] if isinstance(sources, Source) else list(sources)
    return [s if isinstance(s, Recording) else open_recording(s) for s in listed]


def _others(baseline: list[Recording], used: Sequence[Recording]) -> list[Recording]:
    """The clean recordings that are neither criticised nor held out, each once."""
    seen = {recording.hash for recording in used}
    others = []
    for recording in baseline:
        if recording.hash not in seen:
            others.append(recording)
            seen.add(recording.hash)
    return others


def _check_held_out(stirring: Stirring, held_out: Sequence[Recording]) -> None:
    fitted = {recording.hash: recording for recording in stirring.recordings}
    density = stirring.recordings[0].number("liquid_density")
    for recording in held_out:
        if recording.hash in fitted:
            raise InputError(
                "is what the run was calibrated on",
                where=f"--held-out {recording.path}",
                fix="hold out another recording: nothing can be proved on data that were fitted",
            )
        if not np.isclose(recording.number("liquid_density"), density, rtol=0.02):
            raise InputError(
                f"liquid_density is {recording.number('liquid_density'):g} kg/m3, but "
                f"{density:g} in the run",
                where=f"--held-out {recording.path}",
                fix="hold out a recording of the same liquid",
            )
