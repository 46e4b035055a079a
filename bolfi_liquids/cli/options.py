"""Options of the commands, in groups that become arguments of one function each."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..inputs.settings import CalibrationSettings
from .grouped import setting

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
ParticlesOption = Annotated[
    int, typer.Option("--particles", help=setting(CalibrationSettings, "particles").description)
]
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
class PourOptions:
    """Cups, pours that were made, and whether a bad fit may be poured."""

    cups: CupsOption = None
    given: Annotated[
        Path | None,
        typer.Option(
            metavar="TABLE", help="What pours of the liquid spilled; RUN keeps it for later pours."
        ),
    ] = None
    liquid: LiquidOption = None
    pours: Annotated[str | None, typer.Option(hidden=True)] = None
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
