"""The command `record`: a dry run unless a person arms it and types the sentence."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from ..online.settings import OnlineSettings
from ..wording import command
from .errors import FAILED, INTERRUPTED, Aborted
from .examples import examples
from .grouped import grouped
from .options import ExecutionOptions, RigOption, need, one_arm

if TYPE_CHECKING:
    from ..hardware import Check
    from ..online.online import OnlineChoice

OUT = Path("runs/recording")
EPILOG = examples(
    "record --emulator --out runs/stir",
    "record --rig rig.toml --out runs/stir --arm",
)


@dataclass(frozen=True)
class ArmOptions:
    """What moves: nothing, a real arm, or an emulated one with a liquid."""

    arm: Annotated[
        bool, typer.Option("--arm", help="Move the arm, once a typed sentence allows it.")
    ] = False
    emulator: Annotated[
        bool, typer.Option("--emulator", help="All of it with an emulated arm and cameras.")
    ] = False
    viscosity: Annotated[
        float | None, typer.Option(help="Of the emulated liquid [Pa s]; else 1.")
    ] = None

    def __post_init__(self) -> None:
        one_arm(self.arm, self.emulator)
        need(self, "emulator", "viscosity")

    @property
    def arguments(self) -> dict[str, Any]:
        """Who is asked and what is emulated, as `record` takes them."""
        from ..hardware import HiddenLiquid

        emulate = (
            self.emulator if self.viscosity is None else HiddenLiquid(viscosity=self.viscosity)
        )
        return {"ask": typed_sentence if self.arm else None, "emulate": emulate}


@dataclass(frozen=True)
class OnlineOptions:
    """Whether to calibrate while stirring, and for which pour."""

    calibrate: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Calibrate while stirring, and stop when it is enough."),
    ] = None
    cups: Annotated[
        Path | None, typer.Option(metavar="FILE", help="cups.toml of the pour, for --calibrate.")
    ] = None
    target: Annotated[
        float | None,
        typer.Option(
            help="Spilled share at which stirring may end, for --calibrate; "
            f"else {OnlineSettings.target:g}."
        ),
    ] = None

    def __post_init__(self) -> None:
        need(self, "calibrate", "cups", "target")

    def choice(self, cycles: int | None) -> "OnlineChoice | None":
        """What to calibrate, with so many cycles at the most; None for nothing."""
        from ..inputs.cups import cups_of
        from ..online.online import USUAL_CYCLES, OnlineChoice

        if self.calibrate is None:
            return None
        settings = OnlineSettings() if self.target is None else OnlineSettings(target=self.target)
        cycles = USUAL_CYCLES if cycles is None else cycles
        return OnlineChoice(self.calibrate, cups_of(self.cups), settings, cycles=cycles)


@grouped
def record(
    moved: ArmOptions,
    online: OnlineOptions,
    rig: RigOption = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Directory of the recording; new or empty.")
    ] = OUT,
    cycles: Annotated[
        int | None, typer.Option(help="How often the star is stirred; else as in rig.toml.")
    ] = None,
) -> None:
    """Stir, and record it. A dry run unless armed: it plans, checks everything, moves nothing.

    The exit status is 3 where something ended the recording early; what there is was kept.
    """
    from ..calibration.result import Calibration
    from ..inputs.rigs import rig_of
    from ..online.record import record_online
    from ..reporting.warnings import Results
    from ..robot.record import dry_stir
    from ..robot.record import record as run_record
    from .printed import print_calibration, print_next, print_recording, print_warnings

    opened = rig_of(rig)
    if not (moved.arm or moved.emulator):
        _tell_dry(*dry_stir(opened, cycles, out))
        return
    choice = online.choice(cycles)
    with aborted_is_told():
        if choice is None:
            recording = run_record(opened, cycles=cycles, out=out, **moved.arguments)
        else:
            recording = record_online(opened, online=choice, out=out, **moved.arguments)
    print_recording(recording)
    if online.calibrate is not None:
        calibration = Calibration.open(online.calibrate)
        print_calibration(calibration)
        print_warnings(Results.of(calibration.run))
    if recording.attrs["status"] == "aborted":
        reason = recording.attrs.get("reason") or "no reason given"
        raise Aborted(f"{recording.path}: the recording was aborted: {reason}")
    print_next(*next_commands(recording.path, online.calibrate))


def next_commands(recording: Path, calibrated: Path | None) -> list[str]:
    """What may follow a recording, which was perhaps calibrated into a RUN directory already."""
    if calibrated is None:
        return [command("calibrate", recording, "--out", "RUN")]
    return [command("criticise", calibrated), command("pour", calibrated)]


@contextmanager
def aborted_is_told() -> Iterator[None]:
    """A session that was stopped ends the command with a status of its own."""
    from ..hardware import SessionInterrupted, SessionStopped

    try:
        yield
    except SessionInterrupted as err:
        raise Aborted(str(err), INTERRUPTED) from err
    except SessionStopped as err:
        raise Aborted(str(err)) from err


def execute(run: Path, how: ExecutionOptions) -> None:
    """`pour --execute`: a dry run unless armed."""
    from ..inputs.rigs import rig_of
    from ..robot.pour import dry_pour, execute_pour

    opened = rig_of(how.rig)
    if not (how.arm or how.emulator):
        _tell_dry(*dry_pour(run, opened))
        return
    with aborted_is_told():
        done = execute_pour(
            run,
            opened,
            ask=typed_sentence if how.arm else None,
            emulate=how.emulator,
            despite_bad_fit=how.despite_bad_fit,
        )
    typer.echo(f"poured; what the arm did is in {done}")


def typed_sentence(plan: str) -> str:
    """Show the plan, and read what the person types."""
    from ..hardware.session.setup import CONFIRMATION

    typer.echo(plan)
    if not sys.stdin.isatty():
        raise InputError(
            "no person can answer: the input is no terminal",
            where="--arm",
            fix="run it in a terminal, where somebody reads the plan",
        )
    return typer.prompt(f"Type '{CONFIRMATION}' to go on", default="", show_default=False)


def _tell_dry(plan: str, checks: "list[Check]") -> None:
    from .printed import print_checks

    typer.echo(plan)
    print_checks(checks)
    if not all(check.ok for check in checks):
        typer.echo("dry run: nothing was moved; mend what says no, or try it out with --emulator")
        raise typer.Exit(FAILED)
    typer.echo("dry run: nothing was moved; add --arm to do it")
