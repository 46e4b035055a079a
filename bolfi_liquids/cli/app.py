"""The command line; each command calls the function of the same name."""

from pathlib import Path
from typing import Annotated

import typer

from .. import __version__
from ..inputs.settings import (
    RISKS,
    SAMPLERS,
    SURROGATES,
    CalibrationSettings,
    CriticismSettings,
    PourSettings,
)
from ..run.directory import RUN_TOML
from ..run.jax_cache import keep_compilations
from . import (
    check as cli_check,
)
from . import (
    guide,
    import_table,
    reproduce,
)
from . import (
    record as cli_record,
)
from . import (
    rig as cli_rig,
)
from . import (
    simulate as cli_simulate,
)
from .errors import OneLineErrors
from .examples import examples, session
from .printed import (
    complaints_among_results,
    print_findings,
    print_next,
    print_section,
)
from .rig import RigOption

RunArgument = Annotated[Path, typer.Argument(metavar="RUN", help="Directory of a run.")]

app = typer.Typer(
    cls=OneLineErrors,
    help="Learn a liquid by stirring it, then pour it without spilling.",
    epilog=session(
        "calibrate stir.nc --out runs/mine",
        "pour runs/mine",
        "report runs/mine",
        then="Without a recording, try `bolfi-liquids demo`; `bolfi-liquids guide` explains files, "
        "priors and messages.",
    ),
    rich_markup_mode="markdown",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"bolfi-liquids {__version__}")
        raise typer.Exit


@app.callback()
def _global_options(
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks of errors.")] = False,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show it and exit."),
    ] = False,
) -> None:
    """`--debug` is read by `OneLineErrors`."""
    keep_compilations()


@app.command(
    epilog=examples(
        "calibrate stir.nc --budget 20 --out runs/mine",
        "calibrate stir.nc --budget 40 --out runs/mine --resume",
    )
)
def calibrate(  # noqa: PLR0913  one parameter for each option
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING", help="NetCDF files, of one liquid.")
    ],
    out: Annotated[Path, typer.Option(metavar="RUN", help="Directory of the run.")],
    budget: Annotated[
        int, typer.Option(help="Simulations to learn from.")
    ] = CalibrationSettings.budget,
    surrogate: Annotated[
        str, typer.Option(metavar="|".join(SURROGATES), help="What the engine emulates.")
    ] = CalibrationSettings.surrogate,
    sampler: Annotated[
        str, typer.Option(metavar="|".join(SAMPLERS), help="Of the posterior's draws.")
    ] = CalibrationSettings.sampler,
    seed: Annotated[int, typer.Option(help="Of all random numbers.")] = CalibrationSettings.seed,
    particles: Annotated[
        int, typer.Option(help="Of which the simulated liquid is made.")
    ] = CalibrationSettings.particles,
    batch: Annotated[
        int, typer.Option(help="Simulations run at the same time.")
    ] = CalibrationSettings.batch,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with the run in RUN; a larger --budget replaces its results."
        ),
    ] = False,
) -> None:
    """Learn a liquid's parameters from recordings of it being stirred."""
    from ..calibration.calibrate import calibrate as run_calibrate
    from ..inputs.open import open_recordings
    from ..inputs.recording import aborted_recordings

    opened = open_recordings(recordings)
    if resume and not (out / RUN_TOML).exists():
        typer.echo(f"{out}: holds no run to resume: this is a new one", err=True)
    with complaints_among_results():
        run_calibrate(
            opened,
            out=out,
            budget=budget,
            surrogate=surrogate,
            sampler=sampler,
            seed=seed,
            particles=particles,
            batch=batch,
            resume=resume,
        )
    print_section(out, "calibrate")
    for line in aborted_recordings(opened):
        typer.echo(line, err=True)
    print_next(out, "criticise", "pour")


@app.command(
    epilog=examples(
        "criticise runs/mine --held-out other_speed.nc --baseline clean.nc",
        "criticise runs/mine --accept camera_delay",
    )
)
def criticise(  # noqa: PLR0913  one parameter for each option
    run: RunArgument,
    held_out: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="Same liquid, other path or speed: the proof."),
    ] = None,
    baseline: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="Believed to lack nothing, of any liquid."),
    ] = None,
    pours: Annotated[
        Path | None, typer.Option(metavar="CSV", help="What pours of the liquid spilled.")
    ] = None,
    held_out_pours: Annotated[
        Path | None, typer.Option(metavar="CSV", help="Other pours of the liquid: the proof.")
    ] = None,
    liquid: Annotated[
        str | None, typer.Option(metavar="NAME", help="Whose pours, if CSV has several.")
    ] = None,
    cups: Annotated[
        Path | None, typer.Option(metavar="FILE", help="cups.toml; without it, the bundled one.")
    ] = None,
    effects: Annotated[
        list[str] | None, typer.Option(metavar="EFFECT", help="To consider; all if not given.")
    ] = None,
    accept: Annotated[
        list[str] | None, typer.Option(metavar="EFFECT", help="Joins the model in any case.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all random numbers.")] = CriticismSettings.seed,
) -> None:
    """Find where simulation and recording disagree, and which effect is missing."""
    from ..criticism.criticise import criticise as run_criticise
    from ..inputs.cups import open_cups
    from ..inputs.pour_table import open_pours

    for name, given in (("liquid", liquid), ("cups", cups), ("held-out-pours", held_out_pours)):
        if pours is None and given:
            raise typer.BadParameter(f"--{name} needs --pours, which is missing")
    tables = [
        None if path is None else open_pours(path, liquid) for path in (pours, held_out_pours)
    ]
    for table in filter(None, tables):
        if table.unused:
            typer.echo(f"{table.path}: columns not used: {', '.join(table.unused)}", err=True)
    criticism = run_criticise(
        run,
        held_out=held_out or (),
        baseline=baseline or (),
        pours=tables[0],
        held_out_pours=tables[1],
        cups=None if cups is None else open_cups(cups),
        effects=effects or None,
        accept=accept or None,
        seed=seed,
    )
    print_findings(criticism)
    print_next(run, "pour")


@app.command(
    epilog=examples("pour runs/mine --cups cups.toml", "pour runs/mine --execute --emulator")
)
def pour(  # noqa: PLR0913  one parameter for each option
    run: RunArgument,
    cups: Annotated[
        Path | None, typer.Option(metavar="FILE", help="cups.toml; without it, the bundled one.")
    ] = None,
    iterations: Annotated[
        int, typer.Option(help="Angular velocities tried.")
    ] = PourSettings.iterations,
    risk: Annotated[
        str,
        typer.Option(
            metavar="|".join(RISKS), help="Spillage to keep low: the mean, or the worst tenth's."
        ),
    ] = PourSettings.risk,
    execute: Annotated[
        bool, typer.Option("--execute", help="Carry out the pour that RUN has chosen already.")
    ] = False,
    rig: RigOption = None,
    arm: Annotated[
        bool, typer.Option("--arm", help="With --execute: move the arm, once a sentence is typed.")
    ] = False,
    emulator: Annotated[
        bool, typer.Option("--emulator", help="With --execute: move an emulated arm.")
    ] = False,
) -> None:
    """Choose the pour that spills least over all that the liquid might be.

    What a criticism accepted is part of the liquid. With --execute nothing is chosen anew: it is
    a dry run of the chosen pour, unless armed.
    """
    if execute:
        cli_record.execute(run, rig, arm=arm, emulator=emulator)
        return
    for option, given in (("arm", arm), ("emulator", emulator), ("rig", rig)):
        if given:
            raise typer.BadParameter(f"--{option} needs --execute, which is missing")
    from ..criticism.result import latest_calibration
    from ..inputs.cups import bundled_cups, open_cups
    from ..pouring.choose import choose_pour

    chosen_cups = bundled_cups() if cups is None else open_cups(cups)
    choose_pour(latest_calibration(run), chosen_cups, iterations=iterations, risk=risk)
    print_section(run, "pour")
    print_next(run, "report")


@app.command(epilog=examples("report runs/mine", "report runs/mine --still"))
def report(
    run: RunArgument,
    moving: Annotated[
        bool,
        typer.Option(
            "--moving/--still",
            help="With moving pictures of the liquid; the first time they take a minute.",
        ),
    ] = True,
) -> None:
    """Write RUN/report.html, one file that shows it all."""
    from ..reporting.report import report as write_report

    typer.echo(write_report(run, moving=moving))


@app.command(epilog=examples("demo --out runs/demo"))
def demo(
    out: Annotated[Path, typer.Option(metavar="RUN", help="Directory of the run.")] = Path(
        "runs/demo"
    ),
) -> None:
    """Calibrate on the bundled glycerin, criticise, choose a pour and write the report."""
    from ..criticism.result import Criticism
    from ..demo import run_demo

    with complaints_among_results():
        path = run_demo(out)
    print_section(out, "calibrate")
    print_findings(Criticism.open(out))
    print_section(out, "pour")
    typer.echo(f"report: {path}")


# after the commands above, for the help lists them in this order
app.command("import", epilog=import_table.EPILOG)(import_table.import_table)
app.command(epilog=cli_record.EPILOG)(cli_record.record)
app.command(epilog=reproduce.EPILOG)(reproduce.reproduce)
app.command(epilog=guide.EPILOG)(guide.guide)
app.add_typer(cli_simulate.app, name="simulate")
app.add_typer(cli_rig.app, name="rig")
app.add_typer(cli_check.app, name="check")


def main() -> None:
    """Entry point of `bolfi-liquids`."""
    app()
