"""The command group `check`: long validation runs, which go on where they were stopped."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from ..errors import Argument, InputError
from ..inputs.settings import SbcSettings
from .compute import Compute, StudyCompute
from .errors import FAILED
from .examples import examples
from .grouped import grouped
from .options import SbcOptions

app = typer.Typer(help="Long validation runs; a killed one goes on.", no_args_is_help=True)


@app.command(
    epilog=examples(
        "check physics --case ring_couette",
        "check physics --out runs/physics",
        "check physics --against recordings --out runs/physics",
        "check physics --against pours --cell 4 --out runs/cells_of_4_mm",
    )
)
@grouped
def physics(
    compute: Compute,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the results.")] = Path(
        "runs/physics"
    ),
    names: Annotated[
        list[str] | None,
        typer.Option(
            "--case",
            metavar="NAME",
            help="Run this case, with --against this recording or poured liquid; may be repeated. "
            "Without it, all.",
        ),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Repeat a reference solver's recordings, whose liquids DIR/truths.csv holds, and "
            "its pours, whose liquids DIR/pour_truths.csv holds, in place of the cases.",
        ),
    ] = None,
    cell: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Width of the cells of the reference's pours [mm]."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the initial packings.")] = 0,
) -> None:
    """Compare the fluid with theory, measurements or another solver.

    The exit status is 1 when a case is out of its tolerance or failed. What has finished in the
    directory of results before, with the same seed, simulator and case, is not run again.
    --timeout limits each case. `bolfi-liquids guide accuracy` has the bars of --against.
    """
    from rich.console import Console

    if against is None:
        if cell is not None:
            fix = "add `against`; cases have cells of their own"
            raise InputError("is for pours of a reference", where=Argument("cell"), fix=fix)
        from ..checks.physics import check_physics
        from .physics_table import print_physics

        with compute.executor() as executor:
            check = check_physics(
                out, names or (), seed=seed, executor=executor, timeout=compute.timeout
            )
        print_physics(check.records, Console())
    else:
        from ..checks.against import Replays, check_against
        from ..checks.reference import open_reference
        from .against_table import print_against

        width = None if cell is None else cell / 1000.0
        replays = Replays(open_reference(against), tuple(names or ()), cell=width)
        with compute.executor() as executor:
            check = check_against(
                out, replays, seed=seed, executor=executor, timeout=compute.timeout
            )
        print_against(check, Console())
    typer.echo(f"results: {check.results}")
    if not check.passed:
        raise typer.Exit(FAILED)


@app.command(
    epilog=examples("check sbc --out runs/sbc", "check sbc --runs 20 --sequential 0 --design 64")
)
@grouped
def sbc(
    options: SbcOptions,
    compute: StudyCompute,
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

    settings = SbcSettings(**asdict(options))
    with compute.executor() as executor:
        found = check_sbc(
            out, recording, settings=settings, executor=executor, timeout=compute.timeout
        )
    for name, check in found.items():
        typer.echo(f"{name}\n\n{check}\n")
    typer.echo(f"results: {out}")
    if not all(check.ok for check in found.values()):
        raise typer.Exit(FAILED)
