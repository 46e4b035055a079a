"""Options of the commands, in groups that become arguments of one function each."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
BaselineOption = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="RECORDING",
        help="Of any liquid, without an effect: shows the simulator's own error. Repeatable.",
    ),
]


@dataclass(frozen=True)
class CalibrationData:
    """What is learned from besides the recordings: pours of the liquid, and clean recordings."""

    pours: Annotated[
        Path | None,
        typer.Option(metavar="TABLE", help="What pours of the liquid spilled: they count in pour."),
    ] = None
    liquid: LiquidOption = None
    cups: CupsOption = None
    baseline: BaselineOption = None

    def __post_init__(self) -> None:
        need(self, "pours", "liquid", "cups")

    @property
    def arguments(self) -> dict[str, Any]:
        """As `calibrate` takes them."""
        pours = opened_pours(self.pours, self.liquid)
        return {"pours": pours, "cups": self.cups, "baseline": self.baseline or ()}


@dataclass(frozen=True)
class CriticismData(CalibrationData):
    """The same, and what nothing is fitted to."""

    held_out: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="Same liquid, other path or speed: the proof."),
    ] = None
    held_out_pours: Annotated[
        Path | None, typer.Option(metavar="TABLE", help="Other pours of the liquid: the proof.")
    ] = None

    def __post_init__(self) -> None:
        need(self, "pours", "liquid", "cups", "held_out_pours")

    @property
    def arguments(self) -> dict[str, Any]:
        """As `criticise` takes them."""
        held_out_pours = opened_pours(self.held_out_pours, self.liquid)
        unseen = {"held_out": self.held_out or (), "held_out_pours": held_out_pours}
        return super().arguments | unseen


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
    force: Annotated[
        bool, typer.Option("--force", help="Choose a pour even though the fit is bad.")
    ] = False

    def __post_init__(self) -> None:
        need(self, "given", "liquid")

    @property
    def arguments(self) -> dict[str, Any]:
        """As `choose_pour` takes them."""
        given = opened_pours(self.given, self.liquid)
        return {"cups": self.cups, "given": given, "force": self.force}


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
        need(self, "execute", "arm", "emulator", "rig", "despite_bad_fit")
        one_arm(self.arm, self.emulator)


def need(options: object, needed: str, *names: str) -> None:
    """Refuse options `names` of a group where the option `needed` was not given.

    Their default is None or False, which nobody can type.
    """
    for name in names:
        value = getattr(options, name)
        if value is not None and value is not False and not getattr(options, needed):
            given, missing = as_typed(name, needed)
            raise typer.BadParameter(f"{given} needs {missing}, which is missing")


def one_arm(arm: bool, emulator: bool) -> None:
    """Refuse a real and an emulated arm together."""
    if arm and emulator:
        raise typer.BadParameter("--arm moves a real arm, --emulator an emulated one: give one")


def changed(*groups: Any) -> Sequence[str]:
    """The options in groups that are not the default, as they are typed."""
    return as_typed(
        *(
            name
            for group in groups
            for name, value in vars(group).items()
            if value != getattr(type(group)(), name)
        )
    )


def as_typed(*names: str) -> Sequence[str]:
    """The options of fields with these names."""
    return [f"--{name.replace('_', '-')}" for name in names]


def opened_pours(path: Path | None, liquid: str | None) -> "PourTable | None":
    """The pours of one liquid in a table; None without one."""
    from ..inputs.pour_table import open_pours

    return None if path is None else open_pours(path, liquid)
