"""Options of the commands, in groups that become arguments of one function each."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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

if TYPE_CHECKING:
    from ..inputs.pour_table import PourTable

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

    budget: Annotated[int, typer.Option(help="Simulations of the search.")] = (
        CalibrationSettings.budget
    )
    surrogate: Annotated[
        str, typer.Option(metavar="|".join(SURROGATES), help="What is emulated, see guide priors.")
    ] = CalibrationSettings.surrogate
    sampler: Annotated[
        str, typer.Option(metavar="|".join(SAMPLERS), help="Sampler of the posterior.")
    ] = CalibrationSettings.sampler
    seed: SeedOption = CalibrationSettings.seed
    particles: ParticlesOption = CalibrationSettings.particles
    batch: Annotated[int, typer.Option(help="Simulations run at the same time.")] = (
        CalibrationSettings.batch
    )


LiquidOption = Annotated[
    str | None,
    typer.Option("--liquid", metavar="NAME", help="Whose pours count, if the table has several."),
]


@dataclass(frozen=True)
class GivenPourOptions:
    """Pours of the liquid that were made, and the cups."""

    pours: Annotated[
        Path | None,
        typer.Option(metavar="TABLE", help="What pours of the liquid spilled: they count in pour."),
    ] = None
    liquid: LiquidOption = None
    cups: CupsOption = None

    def __post_init__(self) -> None:
        _need(self, "--pours", self.pours, ("liquid", "cups"))

    @property
    def table(self) -> "PourTable | None":
        """The pours."""
        return opened_pours(self.pours, self.liquid)


BaselineOption = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="RECORDING",
        help="Of any liquid, without an effect: shows the simulator's own error. Repeatable.",
    ),
]


@dataclass(frozen=True)
class CalibrationData(GivenPourOptions):
    """The same, and what the simulator's error is learned from."""

    baseline: BaselineOption = None


@dataclass(frozen=True)
class CriticismData:
    """Data that a criticism compares besides the calibrated recordings."""

    held_out: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="Same liquid, other path or speed: the proof."),
    ] = None
    baseline: BaselineOption = None


@dataclass(frozen=True)
class PourData(GivenPourOptions):
    """The same, and pours that nothing is fitted to."""

    held_out_pours: Annotated[
        Path | None, typer.Option(metavar="TABLE", help="Other pours of the liquid: the proof.")
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        _need(self, "--pours", self.pours, ("held_out_pours",))

    @property
    def held_out_table(self) -> "PourTable | None":
        """Pours that nothing is fitted to."""
        return opened_pours(self.held_out_pours, self.liquid)


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
    given: Annotated[
        Path | None,
        typer.Option(
            metavar="TABLE", help="What pours of the liquid spilled; RUN keeps it for later pours."
        ),
    ] = None
    liquid: LiquidOption = None
    budget: Annotated[int, typer.Option(help="Pours simulated at most, 24 to 100.")] = (
        PourSettings.budget
    )
    pours: Annotated[str | None, typer.Option(hidden=True)] = None
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

    def __post_init__(self) -> None:
        if self.pours is not None:
            raise typer.BadParameter(
                "--pours is no option of pour: --given is a table of pours that were made, "
                "--budget the number of pours to simulate"
            )
        _need(self, "--given", self.given, ("liquid",))

    @property
    def table(self) -> "PourTable | None":
        """The pours that were made."""
        return opened_pours(self.given, self.liquid)


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
        _need(self, "--execute", self.execute, ("arm", "emulator", "rig", "despite_bad_fit"))


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
    budget: Annotated[int, typer.Option(help="Simulations of each replicate's search.")] = (
        SbcSettings.budget
    )
    noise_deg: Annotated[float, typer.Option("--noise", help="Of the cameras [deg].")] = (
        SbcSettings.noise_deg
    )
    particles: ParticlesOption = SbcSettings.particles
    seed: SeedOption = SbcSettings.seed


def _need(options: object, needed: str, given: object, names: tuple[str, ...]) -> None:
    """Refuse options `names` of a group where the option `needed` is not `given`."""
    for name in names:
        if getattr(options, name) and not given:
            option = name.replace("_", "-")
            raise typer.BadParameter(f"--{option} needs {needed}, which is missing")


def opened_pours(path: Path | None, liquid: str | None) -> "PourTable | None":
    """The pours of one liquid in a table; None without one."""
    from ..inputs.pour_table import open_pours

    return None if path is None else open_pours(path, liquid)
