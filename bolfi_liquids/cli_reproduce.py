"""The command `reproduce`."""

from pathlib import Path
from typing import Annotated

import typer


def reproduce(
    figures: Annotated[
        list[str] | None, typer.Argument(metavar="[FIGURE]...", help="Names; all without any.")
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the results.")] = Path(
        "runs/reproduce"
    ),
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer repetitions: 20 minutes instead of hours.")
    ] = False,
) -> None:
    """Draw the paper's figures, and those of what it left open.

    inclination, posterior: what stirring shows and teaches, on recordings of another solver;
    recordings: what is chosen from them, and what that solver spilled; geometry: over lip heights
    and receivers, where knowing the liquid matters; spillage, liquids: against the number of
    simulations and by liquid, calibrated by stirring and by pouring; decision: expected spillage
    against the plug-in; surrogates: the signal against the paper's. What has finished in DIR is
    kept: a killed run goes on with the same command.
    """
    from .reproduction.reproduce import reproduce as draw

    draw(
        figures or (),
        out,
        quick=quick,
        done=lambda name, drawn: typer.echo(f"{out / name}.png\n{drawn.says}\n"),
    )
