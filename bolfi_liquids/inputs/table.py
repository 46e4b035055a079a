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
from dataclasses import dataclass
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

    def column(self, name: str, fix: str = "correct the header") -> NDArray[np.object_]:
        """Texts of a column, shape (rows,); upper case and blanks of its name do not matter.

        Raises:
            InputError: No column, or more than one, has this name; `fix` is what to do then.
        """
        exact = [at for at, one in enumerate(self.header) if one == name]
        found = exact or [at for at, one in enumerate(self.header) if _plain(one) == _plain(name)]
        if len(found) == 1:
            return self.cells[:, found[0]]
        where = f"{self.path}: header"
        if found:
            raise InputError(
                f"{len(found)} columns are named {name!r}", where=where, fix="give each its own"
            )
        close = get_close_matches(name, self.header, n=1, cutoff=0.6)
        likely = f"; did you mean {close[0]!r}?" if close else ""
        raise InputError(
            f"no column {name!r} among {', '.join(map(repr, self.header)) or 'none'} "
            f"(delimiter {self.delimiter!r}){likely}",
            where=where,
            fix=fix,
        )

    def numbers(
        self, name: str, fix: str = "correct the header", remark: str = ""
    ) -> NDArray[np.float64]:
        """Numbers of a column, shape (rows,); NaN where one is missing.

        Args:
            name: Of the column.
            fix: What to do if there is none.
            remark: What to say besides if a cell holds something else.

        Raises:
            InputError: There is no such column, or a cell holds something else.
        """
        numbers = np.full(len(self.lines), np.nan)
        for at, cell in enumerate(self.column(name, fix)):
            if cell.lower() in MISSING:
                continue
            try:
                numbers[at] = parse_number(cell, self.decimal)
            except ValueError as err:
                raise InputError(
                    str(err),
                    where=self.where(self.lines[at], name),
                    fix="correct the cell, or leave it empty where a value is missing; this "
                    f"table has {self.decimal!r} as its decimal sign (a decimal comma needs ';' "
                    f"between the cells), and thousands are not set apart{remark}",
                ) from None
        return numbers

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
    if header and all(map(is_number, header)):
        raise InputError(
            "holds numbers, not the names of columns",
            where=f"{path}: line {first}",
            fix=f"write a line of names above the numbers: {','.join(names) or 'a,b,...'}",
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
    if not NUMBERS[decimal].fullmatch(text):
        raise ValueError(f"{text!r:.40} is no number")
    number = float(text.replace(decimal, "."))
    if not math.isfinite(number):
        raise ValueError(f"{text!r:.40} is too large for a number")
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
    except UnicodeDecodeError as err:
        raise InputError(
            f"byte {err.start} is no UTF-8 text", where=str(path), fix=SAVE_AS_CSV
        ) from None
    if "\0" in text:
        raise InputError("not a text file", where=str(path), fix=SAVE_AS_CSV)
    if not text.strip():
        raise InputError(
            "is empty", where=str(path), fix="write a header and a line for each measurement"
        )
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
        raise InputError("is a workbook, which needs openpyxl", where=str(path), fix=fix) from err
    except (OSError, ValueError, LookupError, zipfile.BadZipFile) as err:
        raise InputError("no workbook that can be read", where=str(path), fix=SAVE_AS_CSV) from err
    rows = sheet.to_numpy().tolist()
    return [(line, [cell.strip() for cell in row]) for line, row in enumerate(rows, start=1)]


def _check_row(path: Path, line: int, row: list[str], columns: int) -> None:
    """Refuse a line of fewer or more cells than its header; empty ones may follow the last."""
    if len(row) >= columns and not any(row[columns:]):
        return
    extra = "put quotation marks around a cell that holds the delimiter, or remove what is extra"
    short = "complete the line, with empty cells for what is missing"
    raise InputError(
        f"{len(row)} cells, where the header has {columns}",
        where=f"{path}: line {line}",
        fix=extra if len(row) > columns else short,
    )
