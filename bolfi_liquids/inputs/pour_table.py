"""Tables of pours that were made: what each spilled, caught and kept."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .table import Table, read_table

ACTIONS = ("angular_velocity_deg_s", "distance_cm")
AMOUNTS = ("spilled", "received", "retained")
ACTION_RANGES = (1.0, 1000.0), (-20.0, 50.0)  # of the actions, in their units
LIQUID = "liquid"
MIN_POURS = 3  # from which anything can be learned
FIX_LINE = "mend or remove the line"


@dataclass(frozen=True, eq=False)
class PourTable:
    """Pours of one liquid.

    Attributes:
        path: The file.
        liquid: Its name there; "" if the file has no such column.
        angular_velocity: Of the source [rad/s], shape (A,).
        distance: From the lip to the receiver's axis [m], shape (A,).
        fractions: Spilled, received and retained, shape (A, 3); rows sum to 1.
        hash: SHA-256 of the file's bytes, in hexadecimal.
        unused: Columns of the file that nobody reads.
    """

    path: Path
    liquid: str
    angular_velocity: NDArray[np.float64]
    distance: NDArray[np.float64]
    fractions: NDArray[np.float64]
    hash: str
    unused: tuple[str, ...] = ()

    @property
    def observed(self) -> NDArray[np.float64]:
        """Spilled and retained fractions, shape (2, A); what was received is the rest."""
        return self.fractions[:, [0, 2]].T


def open_pours(path: str | Path, liquid: str | None = None) -> PourTable:
    """Read a table of pours, in the form that `bolfi-liquids guide criticism` shows.

    Args:
        path: The file: columns `angular_velocity_deg_s`, `distance_cm`, and `spilled`,
            `received`, `retained` in any one unit; `liquid` if there are several.
        liquid: Whose pours to take; needed where the file holds more than one liquid's.

    Raises:
        InputError: The file is missing or cannot be used; the message names file, line, column
            and value.
    """
    table = read_table(path)
    needed = (*ACTIONS, *AMOUNTS)
    if not table.header:
        fix = "write a header and a line for each pour"
        raise InputError("is empty", where=str(table.path), fix=fix)
    if missing := [name for name in needed if not table.has(name)]:
        raise InputError(
            f"has no column {', '.join(missing)}",
            where=str(table.path),
            fix=f"give a column for each of {', '.join(needed)}",
        )
    table, liquid = _of_liquid(table, liquid)
    if len(table.lines) < MIN_POURS:
        raise InputError(
            f"too few pours: {len(table.lines)}",
            where=str(table.path),
            fix=f"give at least {MIN_POURS} of them",
        )
    actions = np.stack([_finite(table, name) for name in ACTIONS], axis=1)
    _check_actions(table, actions)
    amounts = np.stack([_amounts(table, name) for name in AMOUNTS], axis=1)
    total = amounts.sum(axis=1, keepdims=True)
    if (total <= 0.0).any():
        raise InputError(
            "spilled, received and retained are all 0",
            where=f"{table.path}: line {table.lines[int(np.argmin(total))]}",
            fix="weigh what was poured",
        )
    return PourTable(
        path=table.path,
        liquid=liquid,
        angular_velocity=np.radians(actions[:, 0]),
        distance=actions[:, 1] / 100.0,
        fractions=amounts / total,
        hash=hashlib.sha256(table.path.read_bytes()).hexdigest(),
        unused=table.others((*needed, LIQUID)),
    )


def _of_liquid(table: Table, liquid: str | None) -> tuple[Table, str]:
    """The rows of one liquid, and its name."""
    if not table.has(LIQUID):
        return table, ""  # the whole file is of one liquid, whatever its name
    of = table.column(LIQUID)
    names = sorted(set(of))
    if liquid is None and len(names) <= 1:
        return table, "".join(names)
    if names == [""]:
        return table, ""
    if liquid is None or liquid not in names:
        raise InputError(
            f"holds pours of {', '.join(names)}" + (f", not of {liquid}" if liquid else ""),
            where=str(table.path),
            fix="say whose to take: --liquid NAME",
        )
    return replace(table, lines=table.lines[of == liquid], cells=table.cells[of == liquid]), liquid


def _check_actions(table: Table, actions: NDArray) -> None:
    """Raise InputError for what no robot could do."""
    for line, row in zip(table.lines, actions, strict=True):
        for name, value, (least, most) in zip(ACTIONS, row, ACTION_RANGES, strict=True):
            if not least <= value <= most:
                raise InputError(
                    f"{value:g} is not between {least:g} and {most:g}",
                    where=table.where(line, name),
                    fix=FIX_LINE,
                )


def _finite(table: Table, name: str) -> NDArray[np.float64]:
    """Numbers of a column, none of which may be missing."""
    values = table.numbers(name)
    if not np.isfinite(values).all():
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        raise InputError(
            f"{table.column(name)[at]!r} is no number",
            where=table.where(table.lines[at], name),
            fix=FIX_LINE,
        )
    return values


def _amounts(table: Table, name: str) -> NDArray[np.float64]:
    values = _finite(table, name)
    if (values < 0.0).any():
        at = int(np.flatnonzero(values < 0.0)[0])
        raise InputError(
            f"{table.column(name)[at]} is negative",
            where=table.where(table.lines[at], name),
            fix="give masses, volumes or counts",
        )
    return values
