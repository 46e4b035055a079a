"""What commands print when they are done."""

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

from ..wording import command, degrees

if TYPE_CHECKING:
    from ..calibration.baseline import Baseline
    from ..calibration.result import Calibration
    from ..criticism.result import Criticism
    from ..demo import Step
    from ..hardware import Check
    from ..inputs.recording import Recording
    from ..next_stir import NextStir
    from ..pouring.result import Pour
    from ..reporting.warnings import Results


@contextmanager
def complaints_among_results() -> Iterator[None]:
    """Suppress the surrogate's warnings: they are printed with the results."""
    from ..inference import EmulatorWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", EmulatorWarning)
        yield


def print_next(*commands: str) -> None:
    """The commands that may follow, to be copied."""
    typer.echo("next: " + " or: ".join(commands))


def print_next_pour(calibration: "Calibration", *others: str) -> None:
    """The same of a run, with `pour`, or `report` where `pour` would refuse this fit."""
    from ..calibration.summary import FitStatus

    fit_is_bad = calibration.summary.fit_status == FitStatus.BAD
    steps = (*others, "report" if fit_is_bad else "pour")
    print_next(*(command(step, calibration.path) for step in steps))


def print_calibration(calibration: "Calibration") -> None:
    """The posterior as a table, how well it fits and how it was made."""
    from ..reporting.facts import calibration_facts

    facts = calibration_facts(calibration)
    rows = {f"{one['name']} {one['unit']}".strip(): one for one in facts["parameters"]}
    columns = {"mean": "mean", "sd": "sd", "5 %": "q05", "50 %": "q50", "95 %": "q95"}
    _print_table("parameter", columns | {"closest": "closest"}, rows)
    _print_prose(("fit", "effort"), {"calibration": facts})


def print_step(step: "Step", own: float, left: float) -> None:
    """What begins and how long it takes, and how long all that is left; on stderr, as progress."""
    seconds, minutes = max(5 * round(own / 5), 5), max(round(left / 60), 1)
    typer.echo(f"{step.name}: {step.text} (about {seconds} s; {minutes} min in all)", err=True)


def print_calibration_and_page(calibration: "Calibration") -> None:
    """A calibration, and where a page shows it already."""
    from ..run.run import REPORT

    print_calibration(calibration)
    typer.echo(f"report so far: {calibration.path / REPORT}")


def print_baseline(baseline: "Baseline") -> None:
    """What the simulator leaves of each clean recording, beside the error that is known."""
    from ..models import stirring_error

    rows = {
        one.recording.path.name: {
            "viscosity": f"{one.viscosity:.3g}",
            "error": degrees(math.degrees(one.error)),
            "known": degrees(math.degrees(stirring_error(one.viscosity))),
        }
        for one in baseline.clean
    }
    columns = {"viscosity Pa s": "viscosity", "error": "error", "known error": "known"}
    _print_table("clean recording", columns, rows)


def print_pour(pour: "Pour") -> None:
    """The chosen pour beside the plug-in, and the given pours that are most like it."""
    from ..reporting.facts import pour_facts

    facts = pour_facts(pour)
    rows = {"chosen": facts, "for the best fit alone": facts["plug_in"]}
    action = {"turn": "turn", "distance": "distance"}
    outcome = {"expected spillage": "spilled", "in 19 of 20 cases": "spilled_q95"}
    _print_table("pour", action | outcome, rows)
    if facts["given"] is not None:
        rows = {f"line {one['line']}": one for one in facts["given"]["nearest"]}
        outcome = {"spilled": "spilled", "expected by simulator alone": "expected"}
        _print_table("given pour", action | outcome, rows)
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
    of_what_there_is = {"where": "where", "poured": "pours", "next": "suggestions"}
    parts = ("verdict", "noise", "baseline", "criticism", "gap", "where", "detectable")
    parts = (*parts, "poured", "next")
    told = [part for part in parts if part not in of_what_there_is or facts[of_what_there_is[part]]]
    _print_prose(told, {"criticism": facts})


def print_next_stir(found: "NextStir") -> None:
    """What to stir, and what that is expected to tell."""
    _print(
        f"next stir: {found.label} ({found.cost:.0f} s). The sd of the viscosity's log is expected "
        f"to fall from {found.sd_before:.3f} to {found.sd_after:.3f}."
    )
    if found.motion is None:
        _print("There is no motion file, for a recording does not hold its plan: record as before.")
    else:
        print_next(command("record", "--motion", found.motion, "--out", "DIR"))


def print_warnings(results: "Results") -> None:
    """Print the report's warnings, each on a line of its own, however long."""
    from ..reporting.warnings import warnings_of

    for warning in warnings_of(results):
        _print(f"warning: {warning}", soft_wrap=True)


def print_seconds(seconds: Mapping[str, float]) -> None:
    """Seconds of each phase, and their share."""
    total = sum(seconds.values())
    rows = {
        phase: {"seconds": f"{spent:.1f}", "share": f"{spent / total:.0%}"}
        for phase, spent in {**seconds, "all": total}.items()
    }
    _print_table("phase", {"seconds": "seconds", "share": "share"}, rows)


def print_checks(checks: "Sequence[Check]") -> None:
    """Print each check: passed, or its fault and cure."""
    from rich.markup import escape
    from rich.table import Table

    table = Table("what", "", "how")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "[bold red]no[/]", escape(check.text))
    _print(table, markup=True)


def print_recording(recording: "Recording") -> None:
    """Print a recording's duration and status."""
    import numpy as np

    seen = np.isfinite(recording.inclination).all(axis=1)
    largest = np.degrees(np.nanmax(np.abs(recording.inclination)))
    _print(
        f"{recording.path}: {recording.attrs['status']}, {recording.time[-1]:.1f} s, "
        f"{seen.mean():.0%} of the samples with both views, inclination up to {largest:.1f} deg",
        soft_wrap=True,
    )


def _print_table(label: str, columns: Mapping[str, str], rows: Mapping[str, Any]) -> None:
    """A table of numbers.

    Args:
        label: What the rows are.
        columns: Heading -> which fact of a row.
        rows: Facts by the rows' names.
    """
    from rich.table import Column, Table

    table = Table(label, *(Column(heading, justify="right") for heading in columns))
    for name, facts in rows.items():
        table.add_row(name, *(facts[fact] for fact in columns.values()))
    _print(table)


def _print_prose(parts: Iterable[str], facts: Mapping[str, Any]) -> None:
    """Each paragraph of these parts of the prose on lines of its own."""
    from ..reporting.prose import prose

    for paragraph in (one for part in parts for one in prose(part, facts)):
        _print(paragraph)


def _print(shown: Any, *, markup: bool = False, soft_wrap: bool = False) -> None:
    """Print as it is, without the colours that rich gives to numbers and paths."""
    from rich.console import Console

    Console().print(shown, highlight=False, markup=markup, soft_wrap=soft_wrap)
