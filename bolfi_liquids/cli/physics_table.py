"""What the command line prints of a physics check."""

from collections.abc import Mapping, Sequence
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
        about = f"{record['name']}: {record['truth']} ({record['source']}): {_verdict(record)}"
        console.print(Text(about, style="bold"))
        if record["rows"]:
            console.print(_compared(record))
    for record in records:
        if record["error"]:
            line = f"{record['name']} failed: {record['error']}; it is tried again next time"
            console.print(line, highlight=False, markup=False, soft_wrap=True)
    passed = sum(record["passed"] for record in records)
    console.print(f"cases within their tolerances: {passed} of {len(records)}", highlight=False)


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
    return UNIT_FORMATS.get(unit, "{:+.2g} " + unit).format(value)
