"""What commands print when they are done."""

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ..wording import command

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from ..calibration.result import Calibration
    from ..criticism.result import Criticism
    from ..hardware import Check
    from ..inputs.recording import Recording
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
    """The posterior as a table, how well it fits and how it was made."""
    from ..reporting.facts import calibration_facts

    facts = calibration_facts(calibration)
    table = _table("parameter", "mean", "sd", "5 %", "50 %", "95 %", "closest")
    for one in facts["parameters"]:
        numbers = ("mean", "sd", "q05", "q50", "q95", "closest")
        table.add_row(f"{one['name']} {one['unit']}".strip(), *(one[name] for name in numbers))
    _console().print(table)
    _print_prose(("fit", "effort"), {"calibration": facts})


def print_pour(pour: "Pour") -> None:
    """The chosen pour beside the plug-in, and the given pours that are most like it."""
    from ..reporting.facts import pour_facts

    facts = pour_facts(pour)
    table = _table("pour", "turn", "distance", "expected spillage", "in 19 of 20 cases")
    for label, action in (("chosen", facts), ("for the best fit alone", facts["plug_in"])):
        numbers = ("turn", "distance", "spilled", "spilled_q95")
        table.add_row(label, *(action[name] for name in numbers))
    _console().print(table)
    if facts["given"] is not None:
        table = _table("given pour", "turn", "distance", "spilled", "expected by simulator alone")
        for one in facts["given"]["nearest"]:
            numbers = ("turn", "distance", "spilled", "expected")
            table.add_row(f"line {one['line']}", *(one[name] for name in numbers))
        _console().print(table)
    _print_prose(("pour",), {"pour": facts})


def print_pour_before(pour: "Pour") -> None:
    """The pour that would have been chosen without a criticism."""
    from ..reporting.facts import pour_facts

    facts = pour_facts(pour)
    expected = f"expected to spill {facts['spilled']}"
    typer.echo(f"pour before criticism: {facts['turn']}, {facts['distance']}, {expected}")


def print_findings(criticism: "Criticism") -> None:
    """The verdict of a criticism, its evidence and what to do next."""
    from ..reporting.facts import criticism_facts

    facts = criticism_facts(criticism)
    parts = {
        "verdict": True,
        "baseline": True,
        "criticism": True,
        "gap": True,
        "where": facts["where"],
        "detectable": True,
        "poured": facts["pours"],
        "next": facts["suggestions"],
    }
    _print_prose([part for part, told in parts.items() if told], {"criticism": facts})


def print_warnings(results: "Results") -> None:
    """What the report would warn of, each on a line of its own, however long."""
    from ..reporting.warnings import warnings_of

    for warning in warnings_of(results):
        _print(f"warning: {warning}", soft_wrap=True)


def print_seconds(seconds: Mapping[str, float]) -> None:
    """Seconds of each phase, and their share."""
    total = sum(seconds.values())
    table = _table("phase", "seconds", "share")
    for phase, spent in (*seconds.items(), ("all", total)):
        table.add_row(phase, f"{spent:.1f}", f"{spent / total:.0%}")
    _console().print(table)


def print_checks(checks: "Sequence[Check]") -> None:
    """What works and what is missing, one line each."""
    from rich.markup import escape
    from rich.table import Table

    table = Table("what", "", "how")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "[bold red]no[/]", escape(check.text))
    _console().print(table)


def print_recording(recording: "Recording") -> None:
    """How long a recording is, and how it went."""
    import numpy as np

    seen = np.isfinite(recording.inclination).all(axis=1)
    largest = np.degrees(np.nanmax(np.abs(recording.inclination)))
    _print(
        f"{recording.path}: {recording.attrs['status']}, {recording.time[-1]:.1f} s, "
        f"{seen.mean():.0%} of the samples with both views, inclination up to {largest:.1f} deg",
        soft_wrap=True,
    )


def _table(label: str, *numbers: str) -> "Table":
    from rich.table import Column, Table

    return Table(label, *(Column(heading, justify="right") for heading in numbers))


def _print_prose(parts: Iterable[str], facts: Mapping[str, Any]) -> None:
    """Each paragraph of these parts of the prose on lines of its own."""
    from ..reporting.prose import prose

    for paragraph in (one for part in parts for one in prose(part, facts)):
        _print(paragraph)


def _print(text: str, *, soft_wrap: bool = False) -> None:
    """Print a text as it is, without the colours that rich gives to numbers and paths."""
    _console().print(text, highlight=False, markup=False, soft_wrap=soft_wrap)


def _console() -> "Console":
    from rich.console import Console

    return Console()
