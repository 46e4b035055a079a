"""What commands print when they are done."""

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..wording import command

if TYPE_CHECKING:
    from ..calibration.result import Calibration
    from ..criticism.result import Criticism
    from ..pouring.result import Pour
    from ..reporting.warnings import Results


@contextmanager
def complaints_among_results() -> Iterator[None]:
    """Suppress the surrogate's warnings: they are printed with the results."""
    from ..inference import EmulatorWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", EmulatorWarning)
        yield


def print_next(run: Path, *commands: str) -> None:
    """The commands that may follow, to be copied."""
    typer.echo("next: " + " or: ".join(command(one, run) for one in commands))


def print_next_pour(calibration: "Calibration", *others: str) -> None:
    """The same, and `pour`, or `report` where `pour` would refuse this fit."""
    from ..calibration.summary import FitStatus

    fit_is_bad = calibration.summary.fit_status == FitStatus.BAD
    print_next(calibration.path, *others, "report" if fit_is_bad else "pour")


def print_calibration(calibration: "Calibration") -> None:
    """The posterior."""
    from rich.console import Console

    from . import tables

    tables.print_calibration(calibration.summary, Console())


def print_pour(pour: "Pour") -> None:
    """The chosen pour."""
    from rich.console import Console

    from . import tables

    tables.print_pour(pour.summary, Console())


def print_warnings(results: "Results") -> None:
    """What the report would warn of."""
    from rich.console import Console

    from ..reporting.warnings import warnings_of
    from . import tables

    tables.print_warnings(warnings_of(results), Console())


def print_seconds(seconds: Mapping[str, float]) -> None:
    """Where time went, by phase."""
    from rich.console import Console

    from . import tables

    tables.print_seconds(seconds, Console())


def print_findings(criticism: "Criticism") -> None:
    """What a criticism found."""
    from rich.console import Console

    from .tables import print_criticism

    print_criticism(criticism.summary, criticism.table, Console())
