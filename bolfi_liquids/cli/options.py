"""Options of the commands, in groups that become arguments of one function each."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ..inputs.settings import (
    RISKS,
    SAMPLERS,
    SURROGATES,
    CalibrationSettings,
    CriticismSettings,
    PourSettings,
    SbcSettings,
)

RunArgument = Annotated[Path, typer.Argument(metavar="RUN", help="Directory of a run.")]
RigOption = Annotated[
    Path | None, typer.Option("--rig", metavar="FILE", help="rig.toml; without it, the bundled.")
]
CupsOption = Annotated[
    Path | None,
    typer.Option("--cups", metavar="FILE", help="cups.toml; without it, the bundled one."),
]
SeedOption = Annotated[int, typer.Option("--seed", help="Seed of all random numbers.")]
ParticlesOption = Annotated[
    int,
    typer.Option(
        "--particles", help="Number of particles; 0: cells follow the stick, or the cup that pours."
    ),
]


@dataclass(frozen=True)
class CalibrationOptions:
    """Settings of `calibrate`, as `CalibrationSettings` describes them."""

    budget: Annotated[int, typer.Option(help="Simulations to learn from.")] = (
        CalibrationSettings.budget
    )
    surrogate: Annotated[
        str, typer.Option(metavar="|".join(SURROGATES), help="What the engine emulates.")
    ] = CalibrationSettings.surrogate
    sampler: Annotated[
        str, typer.Option(metavar="|".join(SAMPLERS), help="Sampler of the posterior.")
    ] = CalibrationSettings.sampler
    seed: SeedOption = CalibrationSettings.seed
    particles: ParticlesOption = CalibrationSettings.particles
    batch: Annotated[int, typer.Option(help="Simulations run at the same time.")] = (
        CalibrationSettings.batch
    )


@dataclass(frozen=True)
class CriticismData:
    """Data that a criticism compares besides the calibrated recordings."""

    held_out: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="Same liquid, other path or speed: the proof."),
    ] = None
    baseline: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RECORDING", help="A recording, of any liquid, in which no effect is expected."
        ),
    ] = None


@dataclass(frozen=True)
class PourData:
    """Tables of pours, of which liquid, and from which cups."""

    pours: Annotated[
        Path | None, typer.Option(metavar="CSV", help="What pours of the liquid spilled.")
    ] = None
    held_out_pours: Annotated[
        Path | None, typer.Option(metavar="CSV", help="Other pours of the liquid: the proof.")
    ] = None
    liquid: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Liquid of the table's pours, if it has several."),
    ] = None
    cups: CupsOption = None

    def __post_init__(self) -> None:
        if self.pours is not None:
            return
        for name in ("liquid", "cups", "held_out_pours"):
            if getattr(self, name):
                option = name.replace("_", "-")
                raise typer.BadParameter(f"--{option} needs --pours, which is missing")


@dataclass(frozen=True)
class EffectOptions:
    """Effects that a criticism considers and accepts."""

    effects: Annotated[
        list[str] | None, typer.Option(metavar="EFFECT", help="To consider; all if not given.")
    ] = None
    accept: Annotated[
        list[str] | None,
        typer.Option(metavar="EFFECT", help="Effect that joins the model whatever the verdict."),
    ] = None
    seed: SeedOption = CriticismSettings.seed


@dataclass(frozen=True)
class PourOptions:
    """What decides the choice of a pour."""

    cups: CupsOption = None
    pours: Annotated[int, typer.Option(help="Pours simulated at most, 24 to 100.")] = (
        PourSettings.pours
    )
    iterations: Annotated[int, typer.Option(help="Angular velocities tried.")] = (
        PourSettings.iterations
    )
    risk: Annotated[
        str,
        typer.Option(
            metavar="|".join(RISKS), help="Spillage to keep low: the mean, or the worst tenth's."
        ),
    ] = PourSettings.risk
    force: Annotated[
        bool, typer.Option("--force", help="Choose a pour even though the fit is bad.")
    ] = False


@dataclass(frozen=True)
class ExecutionOptions:
    """Whether and how a chosen pour is carried out."""

    execute: Annotated[
        bool, typer.Option("--execute", help="Carry out the pour that RUN has chosen already.")
    ] = False
    rig: RigOption = None
    arm: Annotated[
        bool, typer.Option("--arm", help="With --execute: move the arm, once a sentence is typed.")
    ] = False
    emulator: Annotated[
        bool, typer.Option("--emulator", help="With --execute: move an emulated arm.")
    ] = False
    despite_bad_fit: Annotated[
        bool,
        typer.Option("--despite-bad-fit", help="With --arm: though it was chosen over a bad fit."),
    ] = False

    def __post_init__(self) -> None:
        if self.execute:
            return
        for name in ("arm", "emulator", "rig", "despite_bad_fit"):
            if getattr(self, name):
                option = name.replace("_", "-")
                raise typer.BadParameter(f"--{option} needs --execute, which is missing")


@dataclass(frozen=True)
class SbcOptions:
    """Settings of `check sbc`, as `SbcSettings` describes them."""

    runs: Annotated[int, typer.Option(help="Replicates of the emulator of the inclination.")] = (
        SbcSettings.runs
    )
    sequential: Annotated[int, typer.Option(help="Replicates of the paper's surrogate.")] = (
        SbcSettings.sequential
    )
    design: Annotated[
        int, typer.Option(help="Points that the emulator's replicates share, each stirred twice.")
    ] = SbcSettings.design
    budget: Annotated[int, typer.Option(help="Simulations that each replicate learns from.")] = (
        SbcSettings.budget
    )
    noise_deg: Annotated[float, typer.Option("--noise", help="Of the cameras [deg].")] = (
        SbcSettings.noise_deg
    )
    particles: ParticlesOption = SbcSettings.particles
    seed: SeedOption = SbcSettings.seed
