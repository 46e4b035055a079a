"""What the command line prints of a physics check, and cells in which such tables agree."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

UNIT_FORMATS = {"relative": "{:+.1%}", "fraction": "{:+.3f}"}


def print_physics(records: Sequence[Mapping[str, Any]], console: Console) -> None:
    """For each case its truth and where that is from, over a table of what was compared."""
    for record in records:
        # as text: brackets of a source or a unit are no markup
        about = f"{record['name']}: {record['truth']} ({record['source']}): {verdict(record)}"
        console.print(Text(about, style="bold"))
        if record["rows"]:
            console.print(compared(record["rows"], record["unit"]))
    print_errors(records, console)
    passed = sum(record["passed"] for record in records)
    console.print(f"cases within their tolerances: {passed} of {len(records)}", highlight=False)


def number_table(label: str, *numbers: str, result: bool = True) -> Table:
    """A table of numbers, each row with a label and, where it is judged, a result."""
    return Table(
        Column(label, no_wrap=True),  # headings give way, names are whole
        # as text: a unit's brackets are no markup
        *(Column(Text(name), justify="right") for name in numbers),
        *([Column("result", no_wrap=True)] if result else []),
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )


def compared(rows: Iterable[Mapping[str, Any]], unit: str) -> Table:
    """Rows of a record, one a line; errors are in `unit`, or in each quantity's own for ""."""
    numbers = ("truth", "ours", "error", "tolerance")
    table = Table(
        Column("compared", ratio=1),
        *(Column(name, justify="right", no_wrap=True, min_width=9) for name in numbers),
        Column("result", no_wrap=True),
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        expand=True,
    )
    for row in rows:
        table.add_row(*_cells(row, unit))
    return table


def print_errors(records: Iterable[Mapping[str, Any]], console: Console) -> None:
    """A line for each record that raised."""
    for record in records:
        if record["error"]:
            line = f"{record['name']} failed: {record['error']}; it is tried again next time"
            print_line(line, console)


def print_line(line: str, console: Console) -> None:
    """As text, however long it is."""
    console.print(line, highlight=False, markup=False, soft_wrap=True)


def verdict(record: Mapping[str, Any]) -> str:
    """Of a record."""
    if record["error"]:
        return "ERROR"
    return pass_or_fail(record["passed"])


def pass_or_fail(passed: bool) -> str:
    """As tables say it."""
    return "pass" if passed else "FAIL"


def fixed(value: float | None, form: str = ".3f") -> str:
    """A number as it is compared: in angles, ratios and times .01 is seen."""
    return "none" if value is None or value != value else format(value, form)


def _cells(row: Mapping[str, Any], unit: str) -> list[Text]:
    tolerance = _error(row["tolerance"], unit).lstrip("+")
    cells = [row["quantity"], _number(row["truth"]), _number(row["ours"])]
    result = pass_or_fail(row["passed"])
    return [Text(cell) for cell in (*cells, _error(row["error"], unit), tolerance, result)]


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.4g}"


def _error(value: float | None, unit: str) -> str:
    if value is None:
        return "none"
    return UNIT_FORMATS.get(unit, f"{{:+.2g}} {unit}".rstrip()).format(value)
