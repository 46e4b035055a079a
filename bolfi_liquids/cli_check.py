"""The command group `check`: long validation runs, which go on where they were stopped."""

from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import FAILED

app = typer.Typer(help="Long validation runs; a killed one goes on.", no_args_is_help=True)


@app.callback()
def _group() -> None:
    """Keeps `check` a group while it has one command."""


@app.command()
def physics(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the results.")] = Path(
        "runs/physics"
    ),
    case: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Run this case; may be repeated. Without it, all."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the initial packings.")] = 0,
) -> None:
    """Compare the fluid with analytic solutions and measurements.

    The exit status is 1 when a case is out of its tolerance or failed. What has finished in DIR
    before, with the same seed, simulator and case, is not run again.
    """
    from rich.console import Console

    from .physics_check import check_physics
    from .physics_table import print_physics

    check = check_physics(out, case or (), seed=seed)
    print_physics(check.records, Console())
    typer.echo(f"results: {check.results}")
    if not check.passed:
        raise typer.Exit(FAILED)
