"""The command `reproduce`."""

from pathlib import Path
from typing import Annotated

import typer

from .compute import StudyCompute
from .examples import examples
from .grouped import grouped

EPILOG = examples("reproduce --quick", "reproduce inclination posterior --out runs/reproduce")


@grouped
def reproduce(
    compute: StudyCompute,
    figures: Annotated[
        list[str] | None, typer.Argument(metavar="FIGURE", help="Names; all without any.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Directory of the results; else runs/reproduce, or runs/reproduce_quick.",
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer truths, coarser stirs: a quarter of an hour.")
    ] = False,
) -> None:
    """Draw the paper's figures, and those of what it left open.

    \b
    - `inclination`: recorded stirs, and what the calibrated simulator predicts
    - `posterior`: what stirring teaches, on recordings of a reference solver
    - `recordings`: what is poured after those of water and glycerin, and the reference spilled
    - `geometry`: over lip heights and receivers, where knowing the liquid matters
    - `spillage`: against the number of simulations, by stirring and by pouring
    - `liquids`: the same by liquid
    - `decision`: expected spillage against the plug-in
    - `surrogates`: the emulated inclination against the paper's discrepancy
    - `strokes`: how many strokes of the stirring are enough
    - `adhesion`: what sticking to the cup costs, and what criticism wins back

    What has finished in DIR is kept: a killed run goes on with the same command.
    """
    from ..reproduction.reproduce import draw_figures
    from ..reproduction.study_size import FULL, QUICK
    from ..run.execution import Execution

    # of one scale each, so that no figure of the one stands beside some of the other
    out = out or Path("runs/reproduce_quick" if quick else "runs/reproduce")
    with compute.executor() as executor:
        execution = Execution(executor, compute.timeout)
        for name, drawn in draw_figures(figures or (), out, QUICK if quick else FULL, execution):
            typer.echo(f"{out / name}.png\n{drawn.says}\n")
