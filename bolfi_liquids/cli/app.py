"""The command line; each command calls the function of the same name."""

import signal
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import __version__
from ..errors import InputError
from ..guide import PAGES, for_terminal, title
from ..inputs.settings import (
    BaselineSettings,
    CalibrationSettings,
    CriticismSettings,
    PourSettings,
    SbcSettings,
)
from ..wording import command
from . import import_table, printed
from . import record as cli_record
from . import rig as cli_rig
from . import simulate as cli_simulate
from . import trim as cli_trim
from .errors import FAILED, OneLineErrors, print_notices
from .options import (
    BaselineOption,
    ComputeOptions,
    CupsOption,
    LiquidOption,
    PoursOption,
    RigOption,
    RunArgument,
    StudyComputeOptions,
    check_needed,
    check_one,
    examples,
    grouped,
    opened_pours,
    typed_options,
)

EXECUTION = ("--arm", "--emulator", "--rig", "--despite-bad-fit")
"""Options of `pour` that say how a chosen pour is carried out."""

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
        "calibrate stir.nc --until spillage=0.02 --out runs/mine",
    )
)
@grouped
def calibrate(  # noqa: PLR0913  an option each
    ctx: typer.Context,
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING", help="NetCDF files, of one liquid.")
    ],
    out: Annotated[Path, typer.Option(metavar="RUN", help="Directory of the run.")],
    settings: CalibrationSettings,
    compute: ComputeOptions,
    pours: PoursOption = None,
    liquid: LiquidOption = None,
    cups: CupsOption = None,
    baseline: BaselineOption = None,
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
    from ..pouring.known import known
    from ..reporting.warnings import Results
    from ..run.run import check_resumable

    check_needed(ctx, "--pours", "--liquid")
    goal = None if settings.until is None else known(settings.until, cups)
    if goal is None or not goal.scene:
        check_needed(ctx, "--pours", "--cups")
    if resume:
        check_resumable(out)
    opened, table = open_recordings(recordings), opened_pours(pours, liquid)
    made_with = None if table is None else cups
    data = {"pours": table, "cups": made_with, "baseline": baseline or ()}
    chosen: dict[str, Any] = {**asdict(settings), "until": goal}
    if "--budget" not in typed_options(ctx):
        del chosen["budget"]
    with printed.complaints_among_results(), compute.arguments() as where:
        calibration = run_calibrate(opened, out=out, resume=resume, **data, **where, **chosen)
    results = Results.of(calibration.run)
    printed.print_calibration(calibration)
    printed.print_warnings(results)
    printed.print_next_pour(results.latest, "criticise")


@app.command(
    epilog=examples(
        "baseline oil.nc glycerin.nc --out rig_error.nc",
        "criticise runs/mine --baseline rig_error.nc",
    )
)
@grouped
def baseline(
    recordings: Annotated[
        list[Path],
        typer.Argument(metavar="RECORDING", help="Of any liquids, without an effect."),
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="To be written, in .nc.")],
    settings: BaselineSettings,
    compute: ComputeOptions,
) -> None:
    """Learn the simulator's own error on a rig, once for all runs.

    What has finished is kept in a file of the same name that ends in .sqlite: repeat the command
    after an interruption, or with further recordings. Give FILE to calibrate and criticise.
    """
    from ..calibration.baseline import learn_baseline

    with compute.arguments() as where:
        made = learn_baseline(recordings, out=out, **asdict(settings), **where)
    printed.print_baseline(made)
    printed.print_next(command("criticise", "RUN", "--baseline", made.path))


@app.command(
    epilog=examples(
        "criticise runs/mine --held-out other_speed.nc --baseline clean.nc",
        "criticise runs/mine --accept camera_delay",
    )
)
@grouped
def criticise(  # noqa: PLR0913  an option each
    ctx: typer.Context,
    run: RunArgument,
    settings: CriticismSettings,
    compute: ComputeOptions,
    pours: PoursOption = None,
    liquid: LiquidOption = None,
    cups: CupsOption = None,
    baseline: BaselineOption = None,
    held_out: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="Same liquid, other path or speed: the proof."),
    ] = None,
    held_out_pours: Annotated[
        Path | None, typer.Option(metavar="TABLE", help="Other pours of the liquid: the proof.")
    ] = None,
) -> None:
    """Find which effect the model lacks, where it misses the data."""
    from ..criticism.criticise import criticise as run_criticise

    check_needed(ctx, "--pours", "--liquid", "--cups", "--held-out-pours")
    fitted = {"pours": opened_pours(pours, liquid), "cups": cups, "baseline": baseline or ()}
    proof = {"held_out": held_out or (), "held_out_pours": opened_pours(held_out_pours, liquid)}
    with compute.arguments() as where:
        criticism = run_criticise(run, **fitted, **proof, **asdict(settings), **where)
    printed.print_findings(criticism)
    printed.print_next_pour(criticism.calibration)


@app.command(epilog=examples("design runs/mine"))
@grouped
def design(run: RunArgument, compute: ComputeOptions) -> None:
    """Find the next stir that tells most of the liquid.

    RUN/design_stir.toml gets its motion, for `record --motion`. There is no such file where the
    recorded stir is best again. If an effect is missing, `criticise` finds the stir that tells
    which.
    """
    from ..next_stir import design_stir

    with compute.arguments() as where:
        printed.print_next_stir(design_stir(run, **where))


@app.command(
    epilog=examples(
        "pour runs/mine --cups cups.toml",
        "pour runs/mine --given pours.csv",
        "pour runs/mine --execute --emulator",
    )
)
@grouped
def pour(  # noqa: PLR0913  an option each
    ctx: typer.Context,
    run: RunArgument,
    settings: PourSettings,
    compute: ComputeOptions,
    cups: CupsOption = None,
    given: Annotated[
        Path | None,
        typer.Option(
            metavar="TABLE", help="What pours of the liquid spilled; RUN keeps it for later pours."
        ),
    ] = None,
    liquid: LiquidOption = None,
    force: Annotated[
        bool, typer.Option("--force", help="Choose a pour even though the fit is bad.")
    ] = False,
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
    despite_bad_fit: Annotated[
        bool,
        typer.Option("--despite-bad-fit", help="With --arm: though it was chosen over a bad fit."),
    ] = False,
) -> None:
    """Choose the pour that spills least over the posterior.

    What a criticism accepted is part of the liquid, and pours that were made correct the choice.
    With --execute nothing is chosen anew: it is a dry run of the chosen pour, unless armed.
    """
    check_needed(ctx, "--execute", *EXECUTION)
    if execute:
        if typed := set(typed_options(ctx)) - {"--execute", *EXECUTION}:
            raise InputError(
                "of the choice of a pour, and --execute carries out what RUN has chosen already",
                where=", ".join(sorted(typed)),
                fix="choose without --execute first",
            )
        check_one(ctx, "--arm", "--emulator")
        cli_record.execute(run, rig, arm=arm, emulate=emulator, despite_bad_fit=despite_bad_fit)
        return
    from ..pouring.choose import choose_pour
    from ..reporting.warnings import Results

    check_needed(ctx, "--given", "--liquid")
    data = {"cups": cups, "given": opened_pours(given, liquid), "force": force}
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
        made = run_demo(
            out,
            compute=opened,
            begins=printed.print_step,
            fitted=printed.print_calibration_and_page,
            criticised=printed.print_findings,
        )
    printed.print_pour_before(made.pour_before)
    printed.print_pour(made.pour)
    printed.print_warnings(Results.of(made.calibration.run))
    printed.print_seconds(made.seconds)
    typer.echo(f"report: {made.report}")


# after the commands above, for the help lists them in this order
app.command("import", epilog=import_table.EPILOG)(import_table.import_table)
app.command(epilog=cli_record.EPILOG)(cli_record.record)
app.command(epilog=cli_trim.EPILOG)(cli_trim.trim)


@app.command(epilog=examples("guide", "guide files", "guide troubleshooting | less -R"))
def guide(
    page: Annotated[
        str | None, typer.Argument(metavar="|".join(PAGES), help="Which; without it, a list.")
    ] = None,
) -> None:
    """Show a page of the guide: files, priors, messages and more."""
    if page is None:
        width = max(map(len, PAGES))
        for name in PAGES:
            typer.echo(f"{name:{width}}  {title(name)}")
        typer.echo("read one: bolfi-liquids guide PAGE")
        return
    from rich.console import Console

    Console().print(for_terminal(page))


app.add_typer(cli_simulate.app, name="simulate")
app.add_typer(cli_rig.app, name="rig")
check = typer.Typer(help="Long checks; a killed one goes on.", no_args_is_help=True)
app.add_typer(check, name="check")


@check.command(
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
    for name, made in found.items():
        typer.echo(f"{name}\n\n{made}\n")
    typer.echo(f"results: {out}")
    if not all(made.ok for made in found.values()):
        raise typer.Exit(FAILED)


def main() -> None:
    """Entry point of `bolfi-liquids`."""
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"  # without its line
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # says how to go on, as Ctrl-C
    app()
