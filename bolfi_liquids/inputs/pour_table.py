"""Tables of pours that were made: what each spilled, caught and kept."""

import hashlib
import logging
import re
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import Argument, InputError
from .cups import cups_of
from .limits import INF, Limits
from .table import Table, is_number, read_table
from .toml_file import opened

if TYPE_CHECKING:
    from ..models import Cups

logger = logging.getLogger(__name__)

REMOVE = "remove the line"
CELL = f"correct the cell, or {REMOVE}"
ACTIONS = {
    "angular_velocity_deg_s": Limits("", 1.0, 1000.0, "deg/s", CELL),
    "distance_cm": Limits("", -20.0, 50.0, "cm", CELL),
}
"""Columns of what a robot did, and its limits."""

ANGULAR_VELOCITY, DISTANCE = ACTIONS
AMOUNTS = ("spilled", "received", "retained")
LIQUID = "liquid"
MAX_DRIFT = 0.005
"""Of a pour's amount, by which a scale may have drifted below 0, which then counts as 0."""
MAX_TIMES_BEYOND = 4.0  # that a pour may be faster or slower than the cups' range
MAX_TIMES_TOTAL = 10.0  # that a pour may be more or less than the usual one of its table
ROUNDING = 1e-9  # relative, of an action at an end of the cups' range
MIN_DISTANCE_SHARE = 0.02  # of the cups' longest; a table whose distances all are shorter is in m

ENOUGH = Limits("number of pours", 3, INF, "", "give more: fewer teach nothing")
DRIFT = Limits(
    "a scale's drift below 0 over the pour's amount",
    0.0,
    MAX_DRIFT,
    "",
    "set the scale to 0 and weigh again, or remove the line",
)


@dataclass(frozen=True, eq=False)
class PourTable:
    """Pours of one liquid.

    Attributes:
        path: The file.
        liquid: Its name there; "" if the file has no such column.
        angular_velocity: Of the source [rad/s], shape (A,).
        distance: From the lip to the receiver's axis [m], shape (A,).
        fractions: Spilled, received and retained, shape (A, 3); rows sum to 1.
        lines: Of the file, shape (A,).
        hash: SHA-256 of the file's bytes, in hexadecimal.
    """

    path: Path
    liquid: str
    angular_velocity: NDArray[np.float64]
    distance: NDArray[np.float64]
    fractions: NDArray[np.float64]
    lines: NDArray[np.int64]
    hash: str

    @property
    def observed(self) -> NDArray[np.float64]:
        """Spilled and retained fractions, shape (2, A); what was received is the rest."""
        return self.fractions[:, [0, 2]].T

    def within(self, cups: "Cups") -> "PourTable":
        """Those of the pours whose action is in the range of these cups."""
        inside = np.ones(len(self.lines), bool)
        ranges = cups.angular_velocity_range, cups.distance_range
        for values, ends in zip((self.angular_velocity, self.distance), ranges, strict=True):
            low, high = np.array(ends) + np.array([-1.0, 1.0]) * ROUNDING * np.abs(ends)
            inside &= (values >= low) & (values <= high)
        return replace(
            self,
            angular_velocity=self.angular_velocity[inside],
            distance=self.distance[inside],
            fractions=self.fractions[inside],
            lines=self.lines[inside],
        )


Pours = PourTable | str | Path
"""A table of pours, or its path."""


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
    names = (*ACTIONS, *AMOUNTS)
    table = read_table(path, names)
    table.require(names, f"give a column for each of {', '.join(names)}")
    table, liquid = _of_liquid(table, liquid)
    ENOUGH.check(len(table.lines), str(table.path))
    values = {name: table.numbers(name, required=REMOVE) for name in names}
    for name, limits in ACTIONS.items():
        for line, value in zip(table.lines, values[name], strict=True):
            limits.check(value, table.where(line, name))
    amounts = _amounts(table, values)
    if unused := table.others((*names, LIQUID)):
        logger.warning("%s: columns not used: %s", table.path, ", ".join(unused))
    return PourTable(
        path=table.path,
        liquid=liquid,
        angular_velocity=np.radians(values[ANGULAR_VELOCITY]),
        distance=values[DISTANCE] / 100.0,
        fractions=amounts / amounts.sum(axis=1, keepdims=True),
        lines=np.asarray(table.lines),
        hash=hashlib.sha256(table.path.read_bytes()).hexdigest(),
    )


def _amounts(table: Table, values: dict[str, NDArray]) -> NDArray[np.float64]:
    """Spilled, received and retained of each pour in the table's unit, shape (rows, 3).

    Raises:
        InputError: One is beyond a scale's drift below 0, or all of a pour are quite
            another amount than the others': a slip of the pen or of the unit.
    """
    amounts = np.stack([values[name] for name in AMOUNTS], axis=1)
    totals = amounts.sum(axis=1)
    usual, amount = float(np.median(totals)), f"{', '.join(AMOUNTS)} in all"
    if usual <= 0.0:
        what, fix = f"{amount}: usually {usual:g}", "remove the lines in which nothing was poured"
        raise InputError(what, where=str(table.path), fix=fix)
    ends = usual / MAX_TIMES_TOTAL, usual * MAX_TIMES_TOTAL
    whole = Limits(amount, *ends, "", "weigh all in one unit")
    for line, row, total in zip(table.lines, amounts, totals, strict=True):
        for name, value in zip(AMOUNTS, row, strict=True):
            drift = max(-value, 0.0) / max(abs(total), usual)
            DRIFT.check(drift, table.where(line, name), f" ({value:g})")
        whole.check(total, f"{table.path}: line {line}", f" (usually {usual:g})")
    return np.maximum(amounts, 0.0)


def table_of(given: Pours | None, where: str) -> PourTable | None:
    """A table as it is, that of a file, or None.

    Raises:
        InputError: Something else was given, or the file cannot be used.
    """
    if given is None:
        return None
    cure = "a CSV file, or what open_pours returns"
    return opened(given, PourTable, open_pours, where, "table of pours", cure)


def table_and_cups(
    pours: Pours | None, cups: "Cups | str | Path | None"
) -> "tuple[PourTable | None, Cups]":
    """Pours of a liquid, and the cups that they were made with.

    Args:
        pours: A table, or its path; None for none.
        cups: Or a TOML file of them; None takes the bundled ones.

    Raises:
        InputError: Something cannot be used, or cups were given without pours.
    """
    table = table_of(pours, Argument("pours"))
    if cups is not None and table is None:
        raise InputError(
            "there are no pours from them", where=Argument("cups"), fix="give `pours`, too"
        )
    made_with = cups_of(cups)
    if table is not None:
        check_scene(table, made_with)
    return table, made_with


def check_scene(table: PourTable, cups: "Cups") -> None:
    """Refuse pours that cannot have been made with these cups.

    Raises:
        InputError: The first of them; or all distances are too short for these cups.
    """
    for rate, distance in zip(table.angular_velocity, table.distance, strict=True):
        check_rate(float(rate), cups, f"{table.path}: {ANGULAR_VELOCITY}")
        check_distance(float(distance), cups, f"{table.path}: {DISTANCE}")
    longest = 100.0 * float(np.abs(table.distance).max())
    least = 100.0 * MIN_DISTANCE_SHARE * max(map(abs, cups.distance_range))
    if longest > 0.0:
        limits = Limits("longest", least, INF, "cm", "give the distances in cm")
        limits.check(longest, f"{table.path}: {DISTANCE}")


def check_distance(distance: float, cups: "Cups", where: str) -> None:
    """Raise `InputError` for a distance [m] at which the receiver of these cups cannot stand."""
    low, high = (100.0 * end for end in cups.distance_range)
    beyond = max(high - low, 200.0 * cups.receiver.radius)
    cause = f"the cups stand {low:g} to {high:g} cm apart"
    fix = (
        "give the distance from the lip to the receiver's axis in cm, or the cups that were "
        f"poured with{_in_python('m', where)}"
    )
    limits = Limits(cause, low - beyond, high + beyond, "cm", fix)
    _check_action(100.0 * distance, limits, where)


def check_rate(rate: float, cups: "Cups", where: str) -> None:
    """Raise `InputError` for an angular velocity [rad/s] far from those of these cups."""
    given, slow, fast = map(float, np.degrees([rate, *cups.angular_velocity_range]))
    cause = f"the cups are turned at {slow:g} to {fast:g} deg/s"
    fix = "give the angular velocity in deg/s, or the cups that were poured with"
    ends = slow / MAX_TIMES_BEYOND, fast * MAX_TIMES_BEYOND
    limits = Limits(cause, *ends, "deg/s", f"{fix}{_in_python('rad/s', where)}")
    _check_action(given, limits, where)


def _check_action(value: float, limits: Limits, where: str) -> None:
    """Raise `InputError` beyond limits that follow from the cups, with the cause."""
    cause, least, most, unit, fix = limits
    if not least <= value <= most:
        what = f"{value:g} {unit}; {cause}, {least:g} to {most:g} {unit} are allowed"
        raise InputError(what, where=where, fix=fix)


def _in_python(unit: str, where: str) -> str:
    """Text of the unit that a function takes, where tables and commands have another."""
    return f"; in Python, in {unit}" if isinstance(where, Argument) else ""


def _of_liquid(table: Table, liquid: str | None) -> tuple[Table, str]:
    """The rows of one liquid, and its name; the whole table where no column names liquids."""
    if not table.has(LIQUID):
        _check_remarks(table)
        return table, ""
    of = table.column(LIQUID)
    names = sorted(set(of))
    if names == [""] or (liquid is None and len(names) <= 1):
        return table, "".join(names)
    if liquid is None or liquid not in names:
        raise InputError(
            f"holds pours of {', '.join(names)}" + (f", not of {liquid}" if liquid else ""),
            where=str(table.path),
            fix="say whose to take by `liquid`",
        )
    return table.rows(of == liquid), liquid


def _check_remarks(table: Table) -> None:
    """Refuse a liquid column that would be ignored: a name like it over no measurement."""
    others = table.others((*ACTIONS, *AMOUNTS))
    for name, cells in zip(table.header, table.cells.T, strict=True):
        held = [cell for cell in cells if cell]
        if name not in others or not held or all("." in cell and is_number(cell) for cell in held):
            continue
        words = [word for word in re.split(r"[\W\d_]+", name.casefold()) if word]
        if get_close_matches(LIQUID, words, 1, 0.7) or any(LIQUID in word for word in words):
            raise InputError(
                f"column {name!r} is not known; is it {LIQUID!r}?",
                where=f"{table.path}: header",
                fix=f"name it {LIQUID!r} where it says of which liquid a pour is, else otherwise",
            )
