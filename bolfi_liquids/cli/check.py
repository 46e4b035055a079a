"""The command group `check`: long checks, which go on where they were stopped."""

from pathlib import Path
from typing import Annotated

import typer

from ..inputs.settings import SbcSettings
from .compute import StudyComputeOptions
from .errors import FAILED
from .examples import examples
from .grouped import grouped

app = typer.Typer(help="Long checks; a killed one goes on.", no_args_is_help=True)


@app.command(
    epilog=examples("check sbc --out runs/sbc", "check sbc --runs 20 --sequential 0 --design 64")
)
@grouped
def sbc(
    settings: SbcSettings,
    compute: StudyComputeOptions,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the results.")] = Path(
        "runs/sbc"
    ),
    recording: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Whose path and rig are used; else bundled ones."),
    ] = None,
) -> None:
    """Simulation-based calibration of the whole pipeline.

    Stirs of liquids drawn from the prior are calibrated, and the truths compared with the
    posteriors. The exit status is 1 when ranks or coverage fail their test. What has finished in
    DIR before is kept; more replicates can be added to it.
    """
    from ..checks.sbc import check_sbc

    with compute.opened() as opened:
        found = check_sbc(out, recording, settings=settings, compute=opened)
    for name, check in found.items():
        typer.echo(f"{name}\n\n{check}\n")
    typer.echo(f"results: {out}")
    if not all(check.ok for check in found.values()):
        raise typer.Exit(FAILED)
