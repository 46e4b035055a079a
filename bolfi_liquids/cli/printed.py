"""What commands print when they are done."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..wording import command

if TYPE_CHECKING:
    from ..criticism.result import Criticism


@contextmanager
def complaints_among_results() -> Iterator[None]:
    """What the surrogate's checks complain of is printed with its results, and not before."""
    from ..inference import EmulatorWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", EmulatorWarning)
        yield


def print_next(run: Path, *commands: str) -> None:
    """The commands that may follow, to be copied."""
    typer.echo("next: " + " or: ".join(command(one, run) for one in commands))


def print_next_pour(run: Path, *others: str) -> None:
    """The same, and `pour`, or `report` where `pour` would refuse the latest fit."""
    from ..calibration.summary import FitStatus
    from ..criticism.result import latest_calibration

    fit_is_bad = latest_calibration(run).summary.fit_status == FitStatus.BAD
    print_next(run, *others, "report" if fit_is_bad else "pour")


def print_section(run: Path, name: str) -> None:
    """Section "calibrate" or "pour" of a run's summary."""
    from rich.console import Console

    from ..calibration.summary import CalibrationSummary
    from ..pouring.result import PourSummary
    from .tables import print_calibration, print_pour

    if name == CalibrationSummary.SECTION:
        print_calibration(CalibrationSummary.read(run), Console())
    else:
        print_pour(PourSummary.read(run), Console())


def print_warnings(run: Path) -> None:
    """What the report would warn of."""
    from rich.console import Console

    from ..calibration.result import Calibration
    from ..reporting.warnings import results_of, warnings_of
    from . import tables

    tables.print_warnings(warnings_of(results_of(Calibration.open(run))), Console())


def print_findings(criticism: "Criticism") -> None:
    """What a criticism found."""
    from rich.console import Console

    from .tables import print_criticism

    print_criticism(criticism.summary, criticism.table, Console())
