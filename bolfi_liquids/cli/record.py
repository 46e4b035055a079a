"""The command `record`: a dry run unless a person arms it and types the sentence."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..online.settings import OnlineSettings
from ..wording import command
from .errors import ABORTED, FAILED, INTERRUPTED, Aborted
from .options import RigOption, check_needed, check_one, examples

if TYPE_CHECKING:
    from ..hardware import Check

EPILOG = examples(
    "record --emulator --out runs/stir",
    "record --rig rig.toml --out runs/stir --arm",
    "record --emulator --motion runs/mine/next_stir.toml --out runs/next",
)


def record(  # noqa: PLR0913  an option each
    ctx: typer.Context,
    arm: Annotated[
        bool, typer.Option("--arm", help="Move the arm, once a typed sentence allows it.")
    ] = False,
    emulator: Annotated[
        bool, typer.Option("--emulator", help="All of it with an emulated arm and cameras.")
    ] = False,
    viscosity: Annotated[float, typer.Option(help="With --emulator: of its liquid [Pa s].")] = 1.0,
    calibrate: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Calibrate while stirring, and stop when it is enough."),
    ] = None,
    cups: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With --calibrate: cups.toml; else the bundled one."),
    ] = None,
    target: Annotated[
        float, typer.Option(help="With --calibrate: spilled share at which stirring may end.")
    ] = OnlineSettings.target,
    rig: RigOption = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Directory of the recording; new or empty.")
    ] = Path("runs/recording"),
    motion: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Fields of [stirring] that take the place of the rig's."),
    ] = None,
    cycles: Annotated[
        int | None, typer.Option(help="How often the star is stirred; else as in these files.")
    ] = None,
) -> None:
    """Stir, and record it. A dry run unless armed: it plans, checks everything, moves nothing.

    The exit status is 3 where something ended the recording early; what there is was kept.
    """
    from ..calibration.result import Calibration
    from ..inputs.rigs import rig_of
    from ..reporting.warnings import Results
    from ..robot.record import dry_stir
    from .printed import print_calibration, print_next, print_recording, print_warnings

    check_one(ctx, "--arm", "--emulator")
    check_needed(ctx, "--emulator", "--viscosity")
    check_needed(ctx, "--calibrate", "--cups", "--target")
    opened = rig_of(rig, motion)
    if not (arm or emulator):
        _tell_dry(*dry_stir(opened, cycles, out))
        return
    from ..hardware import HiddenLiquid
    from ..inputs.cups import cups_of
    from ..online.online import USUAL_CYCLES, OnlineChoice
    from ..online.record import record_online
    from ..robot.record import record as run_record

    moved = {
        "ask": typed_sentence if arm else None,
        "emulate": HiddenLiquid(viscosity=viscosity) if emulator else False,
    }
    with aborted_is_told():
        if calibrate is None:
            recording = run_record(opened, cycles=cycles, out=out, **moved)
        else:
            settings = OnlineSettings(target=target)
            most = USUAL_CYCLES if cycles is None else cycles
            choice = OnlineChoice(calibrate, cups_of(cups), settings, cycles=most)
            recording = record_online(opened, online=choice, out=out, **moved)
    print_recording(recording)
    if calibrate is not None:
        calibration = Calibration.open(calibrate)
        print_calibration(calibration)
        print_warnings(Results.of(calibration.run))
    if recording.attrs["status"] == "aborted":
        reason = recording.attrs.get("reason") or "no reason given"
        raise Aborted(f"{recording.path}: the recording was aborted: {reason}")
    print_next(*next_commands(recording.path, calibrate))


def next_commands(recording: Path, calibrated: Path | None) -> list[str]:
    """Commands that may follow a recording, perhaps calibrated into a RUN directory already."""
    if calibrated is None:
        return [command("calibrate", recording, "--out", "RUN")]
    return [command("criticise", calibrated), command("pour", calibrated)]


@contextmanager
def aborted_is_told() -> Iterator[None]:
    """A session that was stopped ends the command with a status of its own."""
    from ..hardware import SessionInterrupted, SessionStopped

    try:
        yield
    except (SessionInterrupted, SessionStopped) as err:
        by_person = isinstance(err, SessionInterrupted)
        raise Aborted(str(err), INTERRUPTED if by_person else ABORTED) from err


def execute(
    run: Path, rig: Path | None, *, arm: bool, emulate: bool, despite_bad_fit: bool
) -> None:
    """`pour --execute`: a dry run unless armed."""
    from ..inputs.rigs import rig_of
    from ..robot.pour import dry_pour, execute_pour

    opened = rig_of(rig)
    if not (arm or emulate):
        _tell_dry(*dry_pour(run, opened))
        return
    ask = typed_sentence if arm else None
    with aborted_is_told():
        done = execute_pour(run, opened, ask=ask, emulate=emulate, despite_bad_fit=despite_bad_fit)
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
