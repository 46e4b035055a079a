"""Columns of a reference's tables of truths."""

import re

import numpy as np

from ..errors import InputError
from ..inputs.table import Table

NAME = re.compile(r"[a-z][a-z0-9_]*")  # of a case, too: its record's and its plot's file


def positive(table: Table, name: str, unit: str, fix: str) -> list[float]:
    """Numbers of a column, all of them positive; arguments of `within`."""
    return within(
        table, name, (np.nextafter(0.0, 1.0), np.inf), f"a positive number in {unit}", fix
    )


def within(
    table: Table, name: str, limits: tuple[float, float], expected: str, fix: str
) -> list[float]:
    """Numbers of a column, none of them missing.

    Args:
        table: The table.
        name: Of the column.
        limits: Least and largest value, both allowed.
        expected: What a cell must hold, for the refusal.
        fix: What to do where there is no such column.

    Raises:
        InputError: The first cell that holds something else.
    """
    values = table.numbers(name, fix)
    for value, cell, line in zip(values, table.column(name), table.lines, strict=True):
        if not limits[0] <= value <= limits[1]:
            raise InputError(f"got {cell!r}", where=table.where(line, name), fix=f"give {expected}")
    return values.tolist()
