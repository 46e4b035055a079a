"""The command group `rig`: the robot and the cameras, before anything is recorded."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from ..wording import command
from .errors import FAILED
from .options import RigOption, examples

app = typer.Typer(help="The robot and the cameras.", no_args_is_help=True)


@app.command(epilog=examples("rig check --rig rig.toml"))
def check(rig: RigOption = None) -> None:
    """Tell what works and what is missing; moves nothing.

    The exit status is 1 when something is missing.
    """
    from ..hardware import check_rig
    from ..inputs.rigs import rig_of
    from .printed import print_checks

    checks = check_rig(rig_of(rig))
    print_checks(checks)
    if not all(one.ok for one in checks):
        raise typer.Exit(FAILED)


@app.command("template", epilog=examples("rig template rig.toml"))
def template(
    out: Annotated[Path, typer.Argument(metavar="FILE", help="To be written.")] = Path("rig.toml"),
) -> None:
    """Write the bundled rig.toml, to make it your own."""
    from ..inputs.bundled import write_template

    then = command("rig", "check", "--rig", out)
    typer.echo(f"{write_template('rig.toml', out)}: change it, then: {then}")


@app.command(
    "calibrate-cameras",
    epilog=examples(
        "rig calibrate-cameras --print-board board.png",
        "rig calibrate-cameras --rig rig.toml --view xz",
    ),
)
def calibrate_cameras(  # noqa: PLR0913  an option each
    boards: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Pictures of the board; without it, they are taken."),
    ] = None,
    plumb_line: Annotated[
        Path | None,
        typer.Option(metavar="PICTURE", help="Of a thread that hangs; without it, it is taken."),
    ] = None,
    square: Annotated[
        float,
        typer.Option(min=0.2, max=20.0, metavar="<float>", help="Side of a printed square, in cm."),
    ] = 2.5,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Of the lens; without it, camera_VIEW.json.")
    ] = None,
    rig: RigOption = None,
    view: Annotated[Literal["xz", "yz"], typer.Option(help="Which camera.")] = "xz",
    print_board: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Only write the board, to be printed.")
    ] = None,
) -> None:
    """Learn a camera's lens from a board and a plumb line."""
    from ..robot.camera_calibration import calibrate_view, write_board

    if print_board is not None:
        typer.echo(f"{write_board(print_board)}: print it, measure a square, glue it on a plate")
        return
    for line in calibrate_view(
        rig, view, square=square / 100, boards=boards, plumb_line=plumb_line, out=out
    ):
        typer.echo(line)
