"""The command group `check`: long validation runs, which go on where they were stopped."""

from pathlib import Path
from typing import Annotated

import typer

from ..inputs.settings import SbcSettings
from .errors import FAILED
from .examples import examples

app = typer.Typer(help="Long validation runs; a killed one goes on.", no_args_is_help=True)


@app.command(epilog=examples("check physics --case couette", "check physics --out runs/physics"))
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

    from ..checks.physics import check_physics
    from .physics_table import print_physics

    check = check_physics(out, case or (), seed=seed)
    print_physics(check.records, Console())
    typer.echo(f"results: {check.results}")
    if not check.passed:
        raise typer.Exit(FAILED)


@app.command(
    epilog=examples("check sbc --out runs/sbc", "check sbc --runs 20 --sequential 0 --design 64")
)
def sbc(  # noqa: PLR0913  one parameter for each option
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the results.")] = Path(
        "runs/sbc"
    ),
    recording: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Whose path and rig are used; else bundled ones."),
    ] = None,
    runs: Annotated[
        int, typer.Option(help="Replicates of the emulator of the inclination.")
    ] = SbcSettings.runs,
    sequential: Annotated[
        int, typer.Option(help="Replicates of the paper's surrogate.")
    ] = SbcSettings.sequential,
    design: Annotated[
        int, typer.Option(help="Points that the emulator's replicates share, each stirred twice.")
    ] = SbcSettings.design,
    budget: Annotated[
        int, typer.Option(help="Simulations that each replicate learns from.")
    ] = SbcSettings.budget,
    noise: Annotated[float, typer.Option(help="Of the cameras [deg].")] = SbcSettings.noise_deg,
    particles: Annotated[
        int, typer.Option(help="Of which the simulated liquid is made.")
    ] = SbcSettings.particles,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes; else one for each processor.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all random numbers.")] = SbcSettings.seed,
) -> None:
    """Simulation-based calibration of the whole pipeline, with the particle fluid.

    Stirs of liquids drawn from the prior are calibrated, and the truths looked up in what was
    concluded. The exit status is 1 when ranks or coverage speak against it. What has finished in
    DIR before is kept; more replicates can be added to it.
    """
    from ..checks.sbc import check_sbc

    settings = SbcSettings(
        runs=runs,
        sequential=sequential,
        design=design,
        budget=budget,
        noise_deg=noise,
        particles=particles,
        seed=seed,
    )
    found = check_sbc(out, recording, settings=settings, workers=workers)
    for name, check in found.items():
        typer.echo(f"{name}\n\n{check}\n")
    typer.echo(f"results: {out}")
    if not all(check.ok for check in found.values()):
        raise typer.Exit(FAILED)
