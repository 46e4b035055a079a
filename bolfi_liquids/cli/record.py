"""The command `record`: a dry run unless a person arms it and types the sentence."""

import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..online.settings import OnlineSettings
from .errors import FAILED
from .examples import examples
from .rig import RigOption

if TYPE_CHECKING:
    from ..hardware import Check, Rig
    from ..online.record import OnlineChoice

OUT = Path("runs/recording")
EPILOG = examples(
    "record --emulator --out runs/stir",
    "record --rig rig.toml --out runs/stir --arm",
)


def record(  # noqa: PLR0913  one parameter for each option
    rig: RigOption = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Directory of the recording; new or empty.")
    ] = OUT,
    arm: Annotated[
        bool, typer.Option("--arm", help="Move the arm, once a typed sentence allows it.")
    ] = False,
    emulator: Annotated[
        bool, typer.Option("--emulator", help="All of it with an emulator and rendered cameras.")
    ] = False,
    cycles: Annotated[
        int | None, typer.Option(help="How often the star is stirred; else as in rig.toml.")
    ] = None,
    viscosity: Annotated[
        float | None, typer.Option(help="Of the emulated liquid [Pa s]; else 1.")
    ] = None,
    calibrate: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Calibrate while stirring, and stop when it is enough."),
    ] = None,
    cups: Annotated[
        Path | None, typer.Option(metavar="FILE", help="cups.toml of the pour, for --calibrate.")
    ] = None,
    target: Annotated[
        float | None,
        typer.Option(
            help="Spilled share at which stirring may end, for --calibrate; "
            f"else {OnlineSettings().target:g}."
        ),
    ] = None,
) -> None:
    """Stir, and record it. A dry run unless armed: it plans, checks everything, moves nothing."""
    from ..inputs.cups import open_cups
    from ..inputs.rigs import rig_of
    from ..online.record import OnlineChoice
    from .tables import print_recording

    _one_of(arm, emulator)
    _needs("--calibrate", calibrate, {"--cups": cups, "--target": target})
    _needs("--emulator", emulator or None, {"--viscosity": viscosity})
    opened = rig_of(rig)
    if not (arm or emulator):
        _dry_run(opened, cycles, out)
        return
    online = None
    if calibrate is not None:
        settings = OnlineSettings() if target is None else OnlineSettings(target=target)
        online = OnlineChoice(calibrate, None if cups is None else open_cups(cups), settings)
    liquid = (1.0 if viscosity is None else viscosity) if emulator else None
    recording = _record(opened, out, cycles, online, liquid)
    from rich.console import Console

    print_recording(recording, Console())


def _record(
    rig: "Rig",
    out: Path,
    cycles: int | None,
    online: "OnlineChoice | None",
    viscosity: float | None,
):
    from ..hardware import HiddenLiquid
    from ..online.record import record_online
    from ..robot.record import record as run_record

    emulate: HiddenLiquid | None = None if viscosity is None else HiddenLiquid(viscosity=viscosity)
    ask = None if emulate is not None else typed_sentence
    if online is None:
        return run_record(rig, out=out, ask=ask, emulate=emulate, cycles=cycles)
    return record_online(rig, out=out, ask=ask, emulate=emulate, cycles=cycles, online=online)


def execute(run: Path, rig: Path | None, *, arm: bool, emulator: bool) -> None:
    """`pour --execute`: a dry run unless armed."""
    from ..inputs.rigs import rig_of
    from ..robot.pour import execute_pour

    _one_of(arm, emulator)
    opened = rig_of(rig)
    if not (arm or emulator):
        _dry_pour(run, opened)
        return
    done = execute_pour(run, opened, ask=typed_sentence if arm else None, emulate=emulator)
    typer.echo(f"poured; what the arm did is in {done}")


def _one_of(arm: bool, emulator: bool) -> None:
    if arm and emulator:
        raise typer.BadParameter("--arm moves a real arm, --emulator an emulated one: give one")


def _needs(option: str, given: object, others: dict[str, object]) -> None:
    for name, value in others.items():
        if given is None and value is not None:
            raise typer.BadParameter(f"{name} needs {option}, which is missing")


def typed_sentence(plan: str) -> str:
    """Show the plan, and read what the person types."""
    from ..hardware.session.confirmation import SENTENCE

    typer.echo(plan)
    if not sys.stdin.isatty():
        raise InputError(
            "no person can answer: the input is no terminal",
            where="--arm",
            fix="run it in a terminal, where somebody reads the plan",
        )
    return typer.prompt(f"Type '{SENTENCE}' to go on", default="", show_default=False)


def _dry_run(rig: "Rig", cycles: int | None, out: Path) -> None:
    from ..hardware.session.confirmation import describe
    from ..robot.stir import dry_run, plan_stir

    if out.is_dir() and any(out.iterdir()):
        raise InputError("holds files already", where=str(out), fix="give a new directory: --out")
    plan = plan_stir(rig, cycles)
    typer.echo(describe(plan.paths, rig, "stirring"))
    with tempfile.TemporaryDirectory(dir=_nearest(out)) as directory:
        checks = dry_run(rig, plan, Path(directory))
    _tell_dry(checks)


def _dry_pour(run: Path, rig: "Rig") -> None:
    from ..robot.pour import dry_pour

    with tempfile.TemporaryDirectory(dir=_nearest(run)) as directory:
        text, checks = dry_pour(run, rig, Path(directory))
    typer.echo(text)
    _tell_dry(checks)


def _nearest(out: Path) -> Path:
    """A directory that exists, on the disk that would be written to."""
    return next(one for one in (out, *out.absolute().parents) if one.is_dir())


def _tell_dry(checks: "list[Check]") -> None:
    from rich.console import Console

    from .tables import print_checks

    print_checks(checks, Console())
    if not all(check.ok for check in checks):
        typer.echo("dry run: nothing was moved; mend what says no, or try it out with --emulator")
        raise typer.Exit(FAILED)
    typer.echo("dry run: nothing was moved; add --arm to do it")
