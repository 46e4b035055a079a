"""Tables that a person writes: UTF-8 text with a header and a row for each measurement.

A file that begins with the byte-order mark of UTF-16, as spreadsheets save "Unicode text", is read
as such.

The delimiter is `;` where the header holds one, else a tab where it holds one, else a comma. The
decimal sign is a point. With `;` it is the comma as soon as a number has one. Thousands are not
set apart. A workbook (.xlsx) is read where pandas finds a reader for it.
"""

import codecs
import csv
import math
import re
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import existing_file

MISSING = ("", "nan", "na", "n/a", "null", "none", "-")
NUMBERS = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?", re.ASCII),
}
SAVE_AS_CSV = "save it as CSV in UTF-8"
LEAVE_EMPTY = "leave it empty where a value is missing"

Row = tuple[int, list[str]]
"""Line of a file, counted from 1, and its cells without blanks around them."""


@dataclass(frozen=True, eq=False)
class Table:
    """Cells as they were written; blank lines are left out.

    Attributes:
        path: The file.
        header: Names of the columns.
        delimiter: Between two cells.
        decimal: In a number.
        lines: Line of the file that each row stands in, counted from 1, shape (rows,).
        cells: Texts without blanks around them, shape (rows, columns).
    """

    path: Path
    header: tuple[str, ...]
    delimiter: str
    decimal: str
    lines: NDArray[np.int64]
    cells: NDArray[np.object_]

    def has(self, name: str) -> bool:
        """Whether a column has this name, upper case and blanks aside."""
        return _plain(name) in map(_plain, self.header)

    def others(self, names: Iterable[str]) -> tuple[str, ...]:
        """Columns of other names than these."""
        known = {_plain(name) for name in names}
        return tuple(one for one in self.header if one and _plain(one) not in known)

    def require(self, names: Iterable[str], fix: str = "correct the header") -> None:
        """Refuse a table in which not each name is that of one column.

        Raises:
            InputError: Names of no column, all of them, or of several; `fix` is what to do then.
        """
        counts = {name: len(self._places(name)) for name in names}
        if all(count == 1 for count in counts.values()):
            return
        told = [
            f"{count} columns are named {name!r}" for name, count in counts.items() if count > 1
        ]
        if missing := [name for name, count in counts.items() if not count]:
            likely = {name: get_close_matches(name, self.header, n=1) for name in missing}
            meant = [f"{close[0]!r} for {name!r}" for name, close in likely.items() if close]
            question = f"; did you mean {', '.join(meant)}?" if meant else ""
            told.append(
                f"no column {', '.join(map(repr, missing))} among "
                f"{', '.join(map(repr, self.header)) or 'none'} (delimiter {self.delimiter!r})"
                f"{question}"
            )
        raise InputError("; ".join(told), where=f"{self.path}: header", fix=fix)

    def _places(self, name: str) -> list[int]:
        """Columns of this name; upper case and blanks do not matter unless one has it exactly."""
        exact = [at for at, one in enumerate(self.header) if one == name]
        return exact or [at for at, one in enumerate(self.header) if _plain(one) == _plain(name)]

    def column(self, name: str) -> NDArray[np.object_]:
        """Texts of a column, shape (rows,).

        Raises:
            InputError: No column, or more than one, has this name.
        """
        self.require([name])
        return self.cells[:, self._places(name)[0]]

    def numbers(self, name: str, *, required: str = "", remark: str = "") -> NDArray[np.float64]:
        """Numbers of a column, shape (rows,); NaN where one is missing.

        Args:
            name: Of the column.
            required: Where none may be missing: what to do about a cell that cannot be corrected.
            remark: What to say besides if a cell holds something else.

        Raises:
            InputError: There is no such column, or a cell holds something else.
        """
        numbers = np.full(len(self.lines), np.nan)
        for at, cell in enumerate(self.column(name)):
            if cell.lower() in MISSING and not required:
                continue
            try:
                numbers[at] = parse_number(cell, self.decimal)
            except ValueError as err:
                raise InputError(
                    str(err),
                    where=self.where(self.lines[at], name),
                    fix=f"correct the cell, or {required or LEAVE_EMPTY}; this table has "
                    f"{self.decimal!r} as its decimal sign (a decimal comma needs ';' between "
                    f"the cells), and thousands are not set apart{remark}",
                ) from None
        return numbers

    def rows(self, kept: NDArray[np.bool_]) -> "Table":
        """Those of its rows, bool (rows,)."""
        return replace(self, lines=self.lines[kept], cells=self.cells[kept])

    def where(self, line: int, name: str) -> str:
        """Place of a cell, for a refusal."""
        return f"{self.path}: line {line}, column {name}"


def read_table(
    path: str | Path,
    names: Iterable[str] = (),
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int = 0,
) -> Table:
    """Read a table.

    Args:
        path: The file, UTF-8 text or .xlsx.
        names: Of columns that it should have, for a refusal of one without a header.
        delimiter: Between two cells; None follows the rule of this module.
        decimal: "." or "," in a number; None likewise.
        skip: Lines before the header.

    Raises:
        InputError: The file is missing, is no text, or a line does not fit its header.
    """
    path = existing_file(path)
    if path.suffix.lower() == ".xlsx":
        rows, delimiter, decimal = _sheet(path)[skip:], ",", "."
    else:
        lines = _lines(path)[skip:]
        # by the header alone: below it a decimal comma looks like a delimiter
        signs = (sign for sign in (";", "\t") if sign in "".join(lines[:1]))
        delimiter = delimiter or next(signs, ",")
        rows = _rows(path, lines, delimiter, skip)
    first, header = rows[0] if rows else (1, [])
    while header and not header[-1]:
        header = header[:-1]
    if header and sum(map(is_number, header)) > len(header) / 2:
        raise InputError(
            "holds numbers, not the names of columns",
            where=f"{path}: line {first}",
            fix=f"write a line of names above: {delimiter.join(names) or 'a,b,...'}",
        )
    kept = [(line, row) for line, row in rows[1:] if any(row)]
    for line, row in kept:
        _check_row(path, line, row, len(header))
    cells = np.array([row[: len(header)] for _, row in kept], object)
    comma = delimiter == ";" and any("," in cell and is_number(cell) for cell in cells.ravel())
    return Table(
        path=path,
        header=tuple(header),
        delimiter=delimiter,
        decimal=decimal or ("," if comma else "."),
        lines=np.array([line for line, _ in kept], np.int64),
        cells=cells.reshape(len(kept), len(header)),
    )


def parse_number(text: str, decimal: str = ".") -> float:
    """The number that a text is, blanks around it aside.

    Python reads more than that: digits of other scripts, `3_0`, `infinity`, and 1e999 as infinite.

    Args:
        text: Digits 0 to 9, with a sign, a decimal sign and an exponent where there are such.
        decimal: "." or ",".

    Raises:
        ValueError: The text is something else, or larger than a number may be.
    """
    text = text.strip()
    number = float(text.replace(decimal, ".")) if NUMBERS[decimal].fullmatch(text) else math.nan
    if not math.isfinite(number):
        raise ValueError(f"{text!r:.40} is no finite number")
    return number


def is_number(text: str) -> bool:
    """Whether a cell holds a number, with either decimal sign."""
    return any(one.fullmatch(text.strip()) for one in NUMBERS.values())


def _plain(name: str) -> str:
    """A name as it is compared."""
    return "".join(name.split()).casefold()


def _lines(path: Path) -> list[str]:
    content = path.read_bytes()
    marked = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        text = content.decode("utf-16" if marked else "utf-8-sig")
        fault = "is no text" if "\0" in text else "" if text.strip() else "is empty"
    except UnicodeDecodeError as err:
        text, fault = "", f"byte {err.start} is no UTF-8 text"
    if fault:
        fix = f"{SAVE_AS_CSV}, with a header and a line for each measurement"
        raise InputError(fault, where=str(path), fix=fix)
    return text.splitlines(keepends=True)


def _rows(path: Path, lines: list[str], delimiter: str, skipped: int) -> list[Row]:
    """All lines, blank ones among them, but for Excel's `sep=;`."""
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True)
    try:
        rows = [(reader.line_num + skipped, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as err:
        raise InputError(
            str(err),
            where=f"{path}: line {reader.line_num + skipped}",
            fix="look for a quotation mark that is not closed",
        ) from err
    return rows[1:] if rows and rows[0][1][:1] == ["sep="] else rows


def _sheet(path: Path) -> list[Row]:
    """The first sheet of a workbook."""
    import pandas

    try:
        sheet = pandas.read_excel(path, header=None, dtype=str, na_filter=False)
    except ImportError as err:
        fix = f"pip install openpyxl, or {SAVE_AS_CSV}"
        raise InputError("openpyxl is not installed", where=str(path), fix=fix) from err
    except (OSError, ValueError, LookupError, zipfile.BadZipFile) as err:
        what = "no workbook that can be read"
        raise InputError(what, where=str(path), fix=SAVE_AS_CSV) from err
    rows = sheet.to_numpy().tolist()
    return [(line, [cell.strip() for cell in row]) for line, row in enumerate(rows, start=1)]


def _check_row(path: Path, line: int, row: list[str], columns: int) -> None:
    """Refuse a line of fewer or more cells than its header; empty ones may follow the last."""
    if len(row) >= columns and not any(row[columns:]):
        return
    extra = "put quotation marks around a cell that holds the delimiter, or remove what is extra"
    short = "complete the line, with empty cells for what is missing"
    alone = "; a file holds one table: lines of anything else go into a file of their own"
    raise InputError(
        f"{len(row)} cells, where the header has {columns}",
        where=f"{path}: line {line}",
        fix=(extra if len(row) > columns else short) + alone,
    )
