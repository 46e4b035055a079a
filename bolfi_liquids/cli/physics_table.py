"""What the command line prints of a physics check."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.text import Text

from .record_cells import compared, print_errors, verdict


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
