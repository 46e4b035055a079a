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
from .table import Table, is_number, read_table

if TYPE_CHECKING:
    from ..models import Cups

logger = logging.getLogger(__name__)

RANGES = {
    "angular_velocity_deg_s": (1.0, 1000.0),
    "distance_cm": (-20.0, 50.0),
    "spilled": (0.0, np.inf),
    "received": (0.0, np.inf),
    "retained": (0.0, np.inf),
}
"""Columns of a table and their limits: what a robot can do, and amounts in any one unit."""

ANGULAR_VELOCITY, DISTANCE, *AMOUNTS = RANGES
LIQUID = "liquid"
MIN_POURS = 3  # from which anything can be learned
MAX_TIMES_BEYOND = 4.0  # that a pour may be faster or slower than the cups' range
MAX_TIMES_TOTAL = 10.0  # that a pour may be more or less than the usual one of its table
ROUNDING = 1e-9  # relative, of an action at an end of the cups' range
MIN_DISTANCE_SHARE = 0.02  # of the cups' longest; a table whose distances all are shorter is in m


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
    table = read_table(path, RANGES)
    if missing := [name for name in RANGES if not table.has(name)]:
        raise InputError(
            f"has no column {', '.join(missing)}",
            where=str(table.path),
            fix=f"give a column for each of {', '.join(RANGES)}",
        )
    table, liquid = _of_liquid(table, liquid)
    if len(table.lines) < MIN_POURS:
        raise InputError(
            f"too few pours: {len(table.lines)}",
            where=str(table.path),
            fix=f"give at least {MIN_POURS} of them",
        )
    values = {name: _within(table, name, *ends) for name, ends in RANGES.items()}
    amounts = np.stack([values[name] for name in AMOUNTS], axis=1)
    total = amounts.sum(axis=1, keepdims=True)
    _check_totals(table, total[:, 0])
    if unused := table.others((*RANGES, LIQUID)):
        logger.warning("%s: columns not used: %s", table.path, ", ".join(unused))
    return PourTable(
        path=table.path,
        liquid=liquid,
        angular_velocity=np.radians(values[ANGULAR_VELOCITY]),
        distance=values[DISTANCE] / 100.0,
        fractions=amounts / total,
        lines=np.asarray(table.lines),
        hash=hashlib.sha256(table.path.read_bytes()).hexdigest(),
    )


def table_of(given: Pours | None, where: str) -> PourTable | None:
    """A table as it is, that of a file, or None.

    Raises:
        InputError: Something else was given, or the file cannot be used.
    """
    if given is not None and not isinstance(given, Pours):
        raise InputError(
            f"{given!r:.80} is no table of pours",
            where=where,
            fix="give the path of a CSV file, or what open_pours returns",
        )
    return open_pours(given) if isinstance(given, str | Path) else given


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
    opened = cups_of(cups)
    if table is not None:
        check_scene(table, opened)
    return table, opened


def check_scene(table: PourTable, cups: "Cups") -> None:
    """Refuse pours that cannot have been made with these cups.

    Raises:
        InputError: The first of them; or all distances are too short for these cups.
    """
    for rate, distance in zip(table.angular_velocity, table.distance, strict=True):
        check_rate(float(rate), cups, f"{table.path}: {ANGULAR_VELOCITY}")
        check_distance(float(distance), cups, f"{table.path}: {DISTANCE}")
    longest = float(np.abs(table.distance).max())
    least = MIN_DISTANCE_SHARE * max(map(abs, cups.distance_range))
    if 0.0 < longest < least:
        raise InputError(
            f"the longest is {100.0 * longest:g} cm, at least {100.0 * least:g} cm is expected",
            where=f"{table.path}: {DISTANCE}",
            fix="give the distances in cm",
        )


def check_distance(distance: float, cups: "Cups", where: str) -> None:
    """Raise `InputError` for a distance [m] at which the receiver of these cups cannot stand."""
    low, high = cups.distance_range
    beyond = max(high - low, 2.0 * cups.receiver.radius)
    if low - beyond <= distance <= high + beyond:
        return
    raise InputError(
        f"{100.0 * distance:g} cm; the cups stand {100.0 * low:g} to {100.0 * high:g} cm apart",
        where=where,
        fix="give the distance from the lip to the receiver's axis in cm, or the cups that were "
        f"poured with{_in_python('m', where)}",
    )


def check_rate(rate: float, cups: "Cups", where: str) -> None:
    """Raise `InputError` for an angular velocity [rad/s] far from those of these cups."""
    low, high = cups.angular_velocity_range
    if low / MAX_TIMES_BEYOND <= rate <= high * MAX_TIMES_BEYOND:
        return
    given, slow, fast = np.degrees([rate, low, high])
    raise InputError(
        f"{given:g} deg/s; the cups are turned at {slow:g} to {fast:g} deg/s",
        where=where,
        fix="give the angular velocity in deg/s, or the cups that were poured with"
        + _in_python("rad/s", where),
    )


def _in_python(unit: str, where: str) -> str:
    """What a function takes in another unit than a table or a command."""
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
    return replace(table, lines=table.lines[of == liquid], cells=table.cells[of == liquid]), liquid


def _check_remarks(table: Table) -> None:
    """Refuse a liquid column that would be ignored: a name like it over no measurement."""
    others = table.others(RANGES)
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


def _within(table: Table, name: str, least: float, most: float) -> NDArray[np.float64]:
    """Numbers of a column, none of which may be missing or outside of its limits."""
    values = table.numbers(name)
    wrong = ~((values >= least) & (values <= most))
    if wrong.any():
        at = int(wrong.argmax())
        raise InputError(
            f"{table.column(name)[at]!r} is not between {least:g} and {most:g}",
            where=table.where(table.lines[at], name),
            fix="correct or remove the line; what a scale shows below 0 is 0",
        )
    return values


def _check_totals(table: Table, total: NDArray) -> None:
    """Refuse pours of quite another amount than the others: a slip of the pen or of the unit."""
    usual = float(np.median(total))
    least, most = usual / MAX_TIMES_TOTAL, usual * MAX_TIMES_TOTAL
    wrong = (total <= 0.0) | (total < least) | (total > most)
    if wrong.any():
        at = int(wrong.argmax())
        raise InputError(
            f"{', '.join(AMOUNTS)} are {total[at]:g} in all, where the pours of this table are "
            f"usually {usual:g}, {least:g} to {most:g} allowed",
            where=f"{table.path}: line {table.lines[at]}",
            fix="give all in one unit, and weigh what was poured",
        )
