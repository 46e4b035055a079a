"""Results as text."""

from collections.abc import Sequence


def table(
    heading: str, columns: Sequence[str], rows: Sequence[Sequence[str]], warnings: Sequence[str]
) -> str:
    """A heading, aligned columns (the first to the left), and what was found wrong."""
    cells = [list(columns), *map(list, rows)]
    widths = [max(len(row[j]) for row in cells) for j in range(len(columns))]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]).rstrip()
        for row in cells
    ]
    verdict = [f"! {warning}" for warning in warnings] or ["ok"]
    return "\n".join([heading, *lines, *verdict])
