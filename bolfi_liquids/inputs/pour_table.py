"""Tables of pours that were made: what each spilled, caught and kept."""

import csv
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import existing_file

ACTIONS = ("angular_velocity_deg_s", "distance_cm")
AMOUNTS = ("spilled", "received", "retained")
RANGES = (1.0, 1000.0), (-20.0, 50.0)  # of the actions, in their units
LEAST = 3  # pours from which anything can be learned


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
    """

    path: Path
    liquid: str
    angular_velocity: NDArray[np.float64]
    distance: NDArray[np.float64]
    fractions: NDArray[np.float64]
    hash: str

    @property
    def observed(self) -> NDArray[np.float64]:
        """Spilled and retained fractions, shape (2, A); what was received is the rest."""
        return self.fractions[:, [0, 2]].T


def open_pours(path: str | Path, liquid: str | None = None) -> PourTable:
    """Read a CSV file of pours, in the form of the README.

    Args:
        path: The file: columns `angular_velocity_deg_s`, `distance_cm`, and `spilled`,
            `received`, `retained` in any one unit; `liquid` if there are several.
        liquid: Whose pours to take; needed where the file holds more than one liquid's.

    Raises:
        InputError: The file is missing or cannot be used; the message names file, line, column
            and value.
    """
    path = existing_file(path)
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        missing = [c for c in (*ACTIONS, *AMOUNTS) if c not in (reader.fieldnames or ())]
        if not reader.fieldnames:
            raise InputError("is empty", where=str(path), fix="write a header and a line each pour")
        if missing:
            raise InputError(
                f"has no column {', '.join(missing)}",
                where=str(path),
                fix=f"give a column for each of {', '.join((*ACTIONS, *AMOUNTS))}",
            )
        rows = list(enumerate(reader, start=2))
    rows, liquid = _of_liquid(path, rows, liquid)
    if len(rows) < LEAST:
        raise InputError(
            f"too few pours: {len(rows)}", where=str(path), fix=f"give at least {LEAST} of them"
        )
    numbers = np.array([[_number(path, n, row, c) for c in ACTIONS] for n, row in rows])
    _check_actions(path, [n for n, _ in rows], numbers)
    amounts = np.array([[_amount(path, n, row, c) for c in AMOUNTS] for n, row in rows])
    total = amounts.sum(axis=1, keepdims=True)
    if (total <= 0.0).any():
        line = rows[int(np.argmin(total))][0]
        raise InputError(
            "spilled, received and retained are all 0",
            where=f"{path}: line {line}",
            fix="weigh what was poured",
        )
    return PourTable(
        path=path,
        liquid=liquid,
        angular_velocity=np.radians(numbers[:, 0]),
        distance=numbers[:, 1] / 100.0,
        fractions=amounts / total,
        hash=hashlib.sha256(path.read_bytes()).hexdigest(),
    )


def _of_liquid(path: Path, rows: list[Any], liquid: str | None) -> tuple[list[Any], str]:
    names = sorted({(row.get("liquid") or "").strip() for _, row in rows})
    if liquid is None and len(names) <= 1:
        return rows, "".join(names)
    if names == [""]:
        return rows, ""  # the whole file is of one liquid, whatever its name
    if liquid is None or liquid not in names:
        raise InputError(
            f"holds pours of {', '.join(names)}" + (f", not of {liquid}" if liquid else ""),
            where=str(path),
            fix="say whose to take: --liquid NAME",
        )
    return [(n, row) for n, row in rows if (row.get("liquid") or "").strip() == liquid], liquid


def _check_actions(path: Path, lines: list[int], actions: NDArray) -> None:
    """Raise InputError for what no robot could do."""
    for line, (speed, distance) in zip(lines, actions, strict=True):
        for column, value, (least, most) in zip(ACTIONS, (speed, distance), RANGES, strict=True):
            if not least <= value <= most:
                raise InputError(
                    f"{value:g} is not between {least:g} and {most:g}",
                    where=f"{path}: line {line}, column {column}",
                    fix="mend or remove the line",
                )


def _number(path: Path, line: int, row: dict, column: str) -> float:
    try:
        value = float(row[column])
    except (TypeError, ValueError):
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(
            f"{row[column]!r} is no number",
            where=f"{path}: line {line}, column {column}",
            fix="mend or remove the line",
        )
    return value


def _amount(path: Path, line: int, row: dict, column: str) -> float:
    value = _number(path, line, row, column)
    if value < 0.0:
        raise InputError(
            f"{row[column]} is negative",
            where=f"{path}: line {line}, column {column}",
            fix="give masses, volumes or counts",
        )
    return value
