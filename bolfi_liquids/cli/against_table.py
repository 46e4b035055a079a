"""What the command line prints of a check against a reference's stirs and pours."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..checks.neighbours import MAX_DIFFERENCE
from ..checks.physics_records import row_record
from ..checks.pour_bars import MAX_EXCESS, MAX_LANDING_ERROR, MAX_RETAINED_ERROR, MAX_RMS
from ..checks.pour_replay import EXCESS, LANDING, RETAINED, RMS
from .physics_table import (
    compared,
    fixed,
    number_table,
    pass_or_fail,
    print_errors,
    print_line,
    verdict,
)

if TYPE_CHECKING:
    from ..checks.against import AgainstCheck
    from ..checks.neighbours import Neighbours

Records = Iterable[Mapping[str, Any]]


def print_against(check: "AgainstCheck", console: Console) -> None:
    """What was found of stirs, then of pours, and what was left out."""
    if check.stirs:
        _print_stirs(check, console)
    if check.pours:
        _print_pours(check, console)
    print_errors(check.records, console)
    if check.left_out:
        effects = ", ".join(f"{name} ({effect})" for name, effect in check.left_out.items())
        print_line(f"left out, for they hold an effect of no known size: {effects}", console)
    if check.stirs:
        _print_count("recordings within their bars", check.stirs, console)
        judged = [pair for pair in check.neighbours if pair.judged]
        passed = sum(pair.passed for pair in judged)
        print_line(f"pairs within their bar: {passed} of {len(judged)} judged", console)
    if check.pours:
        _print_count("poured liquids within their bars", check.pours, console)
        passed = sum(row.passed for row in check.across_pours)
        print_line(f"bars across pours kept: {passed} of {len(check.across_pours)}", console)


def _print_stirs(check: "AgainstCheck", console: Console) -> None:
    """A row for each recording, then one for each pair of liquids."""
    console.print(_recordings(check.stirs))
    if check.neighbours:
        console.print(_pairs(check.neighbours))


def _print_pours(check: "AgainstCheck", console: Console) -> None:
    """A row for each pour, then one for each liquid, then what needs several."""
    console.print(_pours(check.pours))
    console.print(_liquids(check.pours))
    if check.across_pours:
        console.print(compared([row_record(row) for row in check.across_pours], ""))


def _print_count(what: str, records: Records, console: Console) -> None:
    passed = [record["passed"] for record in records]
    print_line(f"{what}: {sum(passed)} of {len(passed)}", console)


def _recordings(records: Records) -> Table:
    numbers = ("Pa s", "RMS [deg]", "bar", "spread over seeds [deg]", "bar", "CPU s a stir")
    table = number_table("recording", *numbers)
    for record in records:
        effects = record["settings"]["effects"].items()
        hidden = (f"\n{name} {size:.3g}" for name, size in effects)
        cells = [record["name"] + "".join(hidden), f"{record['settings']['viscosity']:g}"]
        for row in record["rows"]:
            cells += [fixed(row["ours"]), f"{row['tolerance']:g}"]
        # a recording that raised has no rows
        cells += [""] * (6 - len(cells))
        seconds = record["notes"].get("cpu_s")
        table.add_row(*map(Text, (*cells, fixed(seconds), verdict(record))))
    return table


def _pairs(pairs: "Iterable[Neighbours]") -> Table:
    table = number_table("neighbours", "Pa s", "reference [deg]", "ours [deg]", "ratio", "bar")
    for pair in pairs:
        names = f"{pair.thinner},\n{pair.thicker}"
        viscosities = "{:g},\n{:g}".format(*pair.viscosity)
        differences = fixed(pair.reference), fixed(pair.simulated)
        table.add_row(*map(Text, (names, viscosities, *differences, *_judged(pair))))
    return table


def _judged(pair: "Neighbours") -> tuple[str, str, str]:
    """Ratio, bar and verdict."""
    if pair.ratio is None:
        return "", "", "not judged"
    return fixed(pair.ratio), f"1 ± {MAX_DIFFERENCE:g}", pass_or_fail(pair.passed)


def _pours(records: Records) -> Table:
    """Every pour by itself: landings and retained fractions are ours less the reference's."""
    numbers = ("deg/s", "RMS", "landing [mm]", "retained", "best at [cm]", "spills more there")
    table = number_table("pour", *numbers, result=False)
    for record in records:
        for pour in record["notes"].get("pours", ()):
            table.add_row(
                record["name"],
                f"{pour['angular_velocity_deg_s']:g}",
                fixed(pour["rms"]),
                fixed(pour["landing_error_mm"], "+.1f"),
                fixed(pour["retained_error"], "+.3f"),
                fixed(pour["best_distance_cm"], "g"),
                fixed(pour["excess"]),
            )
    return table


def _liquids(records: Records) -> Table:
    """What each liquid is judged by; a cell of what the reference does not tell is empty."""
    bars = (
        (RMS, f"mean RMS, to {MAX_RMS:g}"),
        (LANDING, f"mean landing, to {1e3 * MAX_LANDING_ERROR:g} mm"),
        (RETAINED, f"retained, to {MAX_RETAINED_ERROR:g}"),
        (EXCESS, f"spills more, to {MAX_EXCESS:g}"),
    )
    table = number_table("liquid", "Pa s", *(heading for _, heading in bars), "CPU s a pour")
    for record in records:
        rows = {row["quantity"]: row["ours"] for row in record["rows"]}
        cells = [fixed(rows[bar]) if bar in rows else "" for bar, _ in bars]
        viscosity = f"{record['settings']['viscosity']:g}"
        seconds = fixed(record["notes"].get("cpu_s"))
        table.add_row(*map(Text, (record["name"], viscosity, *cells, seconds, verdict(record))))
    return table
