"""The command line; each command calls the function of the same name."""

import signal
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from .. import __version__
from ..inputs.settings import CalibrationSettings, CriticismSettings, PourSettings
from ..wording import command
from . import check as cli_check
from . import guide, import_table, printed
from . import record as cli_record
from . import rig as cli_rig
from . import simulate as cli_simulate
from . import trim as cli_trim
from .compute import ComputeOptions, StudyComputeOptions
from .errors import OneLineErrors
from .examples import examples
from .grouped import grouped
from .notices import print_notices
from .options import (
    CalibrationData,
    CriticismData,
    ExecutionOptions,
    PourOptions,
    RunArgument,
    changed,
)

app = typer.Typer(
    cls=OneLineErrors,
    help="Learn a liquid by stirring it, then pour it without spilling.",
    epilog=examples(
        "calibrate stir.nc --out runs/mine",
        "pour runs/mine",
        "report runs/mine",
        title="A session:",
        then="Without a recording, try `bolfi-liquids demo`; `bolfi-liquids guide` explains files, "
        "priors and messages.",
    ),
    rich_markup_mode=None,
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
    print_notices()


@app.command(
    epilog=examples(
        "calibrate stir.nc --budget 20 --out runs/mine",
        "calibrate stir.nc --budget 40 --out runs/mine --resume",
    )
)
@grouped
def calibrate(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING", help="NetCDF files, of one liquid.")
    ],
    out: Annotated[Path, typer.Option(metavar="RUN", help="Directory of the run.")],
    settings: CalibrationSettings,
    given: CalibrationData,
    compute: ComputeOptions,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with the run in RUN; a larger --budget replaces its results."
        ),
    ] = False,
) -> None:
    """Learn a liquid's parameters from recordings of stirs."""
    from ..calibration.calibrate import calibrate as run_calibrate
    from ..inputs.open import open_recordings
    from ..reporting.warnings import Results
    from ..run.run import check_resumable

    if resume:
        check_resumable(out)
    opened, data = open_recordings(recordings), given.arguments
    with printed.complaints_among_results(), compute.arguments() as where:
        calibration = run_calibrate(
            opened, out=out, resume=resume, **data, **where, **asdict(settings)
        )
    results = Results.of(calibration.run)
    printed.print_calibration(calibration)
    printed.print_warnings(results)
    printed.print_next_pour(results.latest, "criticise")


@app.command(
    epilog=examples(
        "criticise runs/mine --held-out other_speed.nc --baseline clean.nc",
        "criticise runs/mine --accept camera_delay",
    )
)
@grouped
def criticise(
    run: RunArgument,
    given: CriticismData,
    settings: CriticismSettings,
    compute: ComputeOptions,
) -> None:
    """Find which effect the model lacks, where it misses the data."""
    from ..criticism.criticise import criticise as run_criticise

    data = given.arguments
    with compute.arguments() as where:
        criticism = run_criticise(run, **data, **asdict(settings), **where)
    printed.print_findings(criticism)
    printed.print_next_pour(criticism.calibration)


@app.command(
    epilog=examples(
        "pour runs/mine --cups cups.toml",
        "pour runs/mine --given pours.csv",
        "pour runs/mine --execute --emulator",
    )
)
@grouped
def pour(
    run: RunArgument,
    options: PourOptions,
    settings: PourSettings,
    execution: ExecutionOptions,
    compute: ComputeOptions,
) -> None:
    """Choose the pour that spills least over the posterior.

    What a criticism accepted is part of the liquid, and pours that were made correct the choice.
    With --execute nothing is chosen anew: it is a dry run of the chosen pour, unless armed.
    """
    if execution.execute:
        if typed := changed(options, settings, compute):
            raise typer.BadParameter(
                f"{', '.join(typed)}: of the choice of a pour, which is made without --execute; "
                "with it the pour is carried out that RUN has chosen already"
            )
        cli_record.execute(run, execution)
        return
    from ..pouring.choose import choose_pour
    from ..reporting.warnings import Results

    data = options.arguments
    with compute.arguments() as where:
        chosen = choose_pour(run, **data, **asdict(settings), **where)
    printed.print_pour(chosen)
    printed.print_warnings(Results.of(chosen.run))
    printed.print_next(command("report", run))


@app.command(epilog=examples("report runs/mine", "report runs/mine --still"))
@grouped
def report(
    run: RunArgument,
    compute: ComputeOptions,
    moving: Annotated[
        bool,
        typer.Option(
            "--moving/--still",
            help="With moving pictures of the liquid; kept for later reports.",
        ),
    ] = True,
) -> None:
    """Write RUN/report.html, one file that shows it all.

    A criticism or a pour that does not count is left out, with a warning; the exit status is 0.
    """
    from ..reporting.report import report as write_report

    with compute.arguments() as where:
        path = write_report(run, moving=moving, **where)
    typer.echo(path)


@app.command(epilog=examples("demo --out runs/demo"))
@grouped
def demo(
    compute: StudyComputeOptions,
    out: Annotated[Path, typer.Option(metavar="RUN", help="Directory of the run.")] = Path(
        "runs/demo"
    ),
) -> None:
    """Calibrate, criticise, pour and report on bundled recordings."""
    from ..demo import run_demo
    from ..reporting.warnings import Results

    with printed.complaints_among_results(), compute.opened() as opened:
        made = run_demo(out, compute=opened, fitted=printed.print_calibration)
    printed.print_findings(made.criticism)
    printed.print_pour_before(made.pour_before)
    printed.print_pour(made.pour)
    printed.print_warnings(Results.of(made.calibration.run))
    printed.print_seconds(made.seconds)
    typer.echo(f"report: {made.report}")


# after the commands above, for the help lists them in this order
app.command("import", epilog=import_table.EPILOG)(import_table.import_table)
app.command(epilog=cli_record.EPILOG)(cli_record.record)
app.command(epilog=cli_trim.EPILOG)(cli_trim.trim)
app.command(epilog=guide.EPILOG)(guide.guide)
app.add_typer(cli_simulate.app, name="simulate")
app.add_typer(cli_rig.app, name="rig")
app.add_typer(cli_check.app, name="check")


def main() -> None:
    """Entry point of `bolfi-liquids`."""
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"  # without its line
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # says how to go on, as Ctrl-C
    app()
