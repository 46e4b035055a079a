"""What the command line prints of a physics check."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from ..checks.neighbours import MAX_DIFFERENCE

if TYPE_CHECKING:
    from ..checks.against import AgainstCheck
    from ..checks.neighbours import Neighbours

UNIT_FORMATS = {"relative": "{:+.1%}", "fraction": "{:+.3f}"}


def print_physics(records: Sequence[Mapping[str, Any]], console: Console) -> None:
    """For each case its truth and where that is from, over a table of what was compared."""
    for record in records:
        # as text: brackets of a source or a unit are no markup
        about = f"{record['name']}: {record['truth']} ({record['source']}): {_verdict(record)}"
        console.print(Text(about, style="bold"))
        if record["rows"]:
            console.print(_compared(record))
    _print_errors(records, console)
    passed = sum(record["passed"] for record in records)
    console.print(f"cases within their tolerances: {passed} of {len(records)}", highlight=False)


def print_against(check: "AgainstCheck", console: Console) -> None:
    """A row for each recording, then one for each pair of liquids, and what was left out."""
    console.print(_recordings(check.records))
    _print_errors(check.records, console)
    if check.neighbours:
        console.print(_pairs(check.neighbours))
    if check.left_out:
        effects = ", ".join(f"{name} ({effect})" for name, effect in check.left_out.items())
        _print_line(f"left out, for they hold an effect: {effects}", console)
    passed = sum(record["passed"] for record in check.records)
    _print_line(f"recordings within their bars: {passed} of {len(check.records)}", console)
    judged = [pair for pair in check.neighbours if pair.judged]
    passed = sum(pair.passed for pair in judged)
    _print_line(f"pairs within their bar: {passed} of {len(judged)} judged", console)


def _recordings(records: Iterable[Mapping[str, Any]]) -> Table:
    numbers = ("Pa s", "RMS [deg]", "bar", "spread over seeds [deg]", "bar", "CPU s a stir")
    table = _number_table("recording", *numbers)
    for record in records:
        cells = [record["name"], f"{record['settings']['viscosity']:g}"]
        for row in record["rows"]:
            cells += [_fixed(row["ours"]), f"{row['tolerance']:g}"]
        # a recording that raised has no rows
        cells += [""] * (6 - len(cells))
        seconds = record["notes"].get("cpu_s")
        table.add_row(*map(Text, (*cells, _fixed(seconds), _verdict(record))))
    return table


def _pairs(pairs: "Iterable[Neighbours]") -> Table:
    table = _number_table("neighbours", "Pa s", "reference [deg]", "ours [deg]", "ratio", "bar")
    for pair in pairs:
        names = f"{pair.thinner},\n{pair.thicker}"
        viscosities = "{:g},\n{:g}".format(*pair.viscosity)
        differences = _fixed(pair.reference), _fixed(pair.simulated)
        table.add_row(*map(Text, (names, viscosities, *differences, *_judged(pair))))
    return table


def _judged(pair: "Neighbours") -> tuple[str, str, str]:
    """Ratio, bar and verdict."""
    if pair.ratio is None:
        return "", "", "not judged"
    return _fixed(pair.ratio), f"1 ± {MAX_DIFFERENCE:g}", "pass" if pair.passed else "FAIL"


def _number_table(label: str, *numbers: str) -> Table:
    return Table(
        Column(label, no_wrap=True),  # headings give way, names are whole
        # as text: a unit's brackets are no markup
        *(Column(Text(name), justify="right") for name in numbers),
        Column("result", no_wrap=True),
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )


def _print_errors(records: Iterable[Mapping[str, Any]], console: Console) -> None:
    for record in records:
        if record["error"]:
            line = f"{record['name']} failed: {record['error']}; it is tried again next time"
            _print_line(line, console)


def _print_line(line: str, console: Console) -> None:
    """As text, however long it is."""
    console.print(line, highlight=False, markup=False, soft_wrap=True)


def _compared(record: Mapping[str, Any]) -> Table:
    numbers = ("truth", "ours", "error", "tolerance")
    table = Table(
        Column("compared", ratio=1),
        *(Column(name, justify="right", no_wrap=True, min_width=9) for name in numbers),
        Column("result", no_wrap=True),
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        expand=True,
    )
    for row in record["rows"]:
        table.add_row(*_cells(row, record["unit"]))
    return table


def _cells(row: Mapping[str, Any], unit: str) -> list[Text]:
    tolerance = _error(row["tolerance"], unit).lstrip("+")
    verdict = "pass" if row["passed"] else "FAIL"
    cells = [row["quantity"], _number(row["truth"]), _number(row["ours"])]
    return [Text(cell) for cell in (*cells, _error(row["error"], unit), tolerance, verdict)]


def _verdict(record: Mapping[str, Any]) -> str:
    if record["error"]:
        return "ERROR"
    return "pass" if record["passed"] else "FAIL"


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.4g}"


def _error(value: float | None, unit: str) -> str:
    if value is None:
        return "none"
    return UNIT_FORMATS.get(unit, f"{{:+.2g}} {unit}".rstrip()).format(value)


def _fixed(value: float | None) -> str:
    """An angle, a ratio or a time as they are compared: .01 is seen."""
    return "none" if value is None or value != value else f"{value:.3f}"
