"""Tables that a person writes: text with a header and a row for each measurement."""

import csv
import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import existing_file
from ..numerals import has_decimals, may_have_thousands, parse_number

if TYPE_CHECKING:
    from pandas import DataFrame

DELIMITERS = ",;\t|"
NOT_TEXT = "\0"  # in no table, but in most other files
TOLD_DELIMITER = re.compile("sep=(.)")  # how Excel is told, in the first line
MISSING = ("", "nan", "na", "n/a", "null", "none", "-")


@dataclass(frozen=True, eq=False)
class Table:
    """Cells as they were written; blank lines are left out.

    Attributes:
        path: The file.
        header: Names of the columns, without blanks around them.
        delimiter: Between two cells.
        decimal: In a number.
        lines: Line of the file that each row stands in, counted from 1, shape (rows,).
        cells: Texts without blanks around them, shape (rows, columns); None beyond a line's end.
    """

    path: Path
    header: tuple[str, ...]
    delimiter: str
    decimal: str
    lines: NDArray[np.int64]
    cells: NDArray[np.object_]

    def has(self, name: str) -> bool:
        """Whether a column has this name, upper case and blanks aside."""
        return any(_plain(one) == _plain(name) for one in self.header)

    def others(self, names: Iterable[str]) -> tuple[str, ...]:
        """Columns of other names than these."""
        known = {_plain(name) for name in names}
        return tuple(one for one in self.header if one and _plain(one) not in known)

    def column(self, name: str, fix: str = "correct the header") -> NDArray[np.object_]:
        """Texts of a column, shape (rows,); upper case and blanks of its name do not matter.

        Raises:
            InputError: No column, or more than one, has this name, or a line ends before it.
        """
        column = self.cells[:, self._position(name, fix)]
        for line, cell, row in zip(self.lines, column, self.cells, strict=True):
            if cell is None:
                raise _misfit(self.path, int(line), row.tolist(), len(self.header))
        return column

    def numbers(self, name: str, fix: str = "correct the header") -> NDArray[np.float64]:
        """Numbers of a column, shape (rows,); NaN where one is missing.

        Raises:
            InputError: There is no such column, or a cell holds something else.
        """
        cells = self.column(name, fix)
        pairs = zip(cells, self.lines, strict=True)
        return np.array([self._number(cell, int(line), name) for cell, line in pairs], float)

    def where(self, line: int, name: str) -> str:
        """Place of a cell, for a refusal."""
        return f"{self.path}: line {line}, column {name}"

    def _position(self, name: str, fix: str) -> int:
        exact = [k for k, one in enumerate(self.header) if one == name]
        near = [k for k, one in enumerate(self.header) if _plain(one) == _plain(name)]
        found = exact or near
        if len(found) == 1:
            return found[0]
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

    def _number(self, cell: str, line: int, name: str) -> float:
        if cell.lower() in MISSING:
            return float("nan")
        try:
            return parse_number(cell, self.decimal)
        except ValueError as err:
            raise InputError(
                str(err),
                where=self.where(line, name),
                fix="correct the cell, leave it empty where a value is missing, or remove the line "
                f"if it is no measurement; the decimal sign is taken to be {self.decimal!r}, and "
                "thousands are not set apart",
            ) from None


def read_table(
    path: str | Path, *, delimiter: str | None = None, decimal: str | None = None, skip: int = 0
) -> Table:
    """Read a table.

    Args:
        path: The file, in any usual encoding.
        delimiter: Between two cells; None finds it in the header.
        decimal: "." or "," in a number; None finds it in the cells.
        skip: Lines before the header.

    Raises:
        InputError: The file is missing, is no text, or a line does not fit its header.
    """
    path = existing_file(path)
    lines = _decoded(path).splitlines()
    if not any(map(str.strip, lines)):
        raise InputError(
            "is empty", where=str(path), fix="write a header and a line for each measurement"
        )
    lines = lines[skip:]
    if lines and (told := TOLD_DELIMITER.fullmatch(lines[0].strip())):
        lines, skip, delimiter = lines[1:], skip + 1, delimiter or told[1]
    delimiter = delimiter or _delimiter(lines[0] if lines else "")
    frame = _frame(path, lines, delimiter)
    first, *rows = frame.to_numpy().tolist() or [[]]
    header = _header(first)
    _check_header(path, header, skip + 1)
    kept = [(k, row) for k, row in enumerate(rows, start=skip + 2) if any(map(_text, row))]
    for line, row in kept:
        if any(map(_text, row[len(header) :])):
            raise _misfit(path, line, row, len(header))
    cells = np.empty((len(kept), len(header)), object)
    for k, (_, row) in enumerate(kept):
        cells[k] = [cell.strip() if isinstance(cell, str) else None for cell in row[: len(header)]]
    return Table(
        path=path,
        header=header,
        delimiter=delimiter,
        decimal=decimal or _decimal(path, delimiter, [cell for cell in cells.ravel() if cell]),
        lines=np.array([line for line, _ in kept], np.int64),
        cells=cells,
    )


def _plain(name: str) -> str:
    """A name as it is compared."""
    return "".join(name.split()).casefold()


def _text(cell: Any) -> str:
    """A cell without blanks around it; pandas marks cells that a line does not have by None."""
    return cell.strip() if isinstance(cell, str) else ""


def _decoded(path: Path) -> str:
    """The file's text: UTF-8, what its byte order mark says, or the likeliest encoding."""
    from charset_normalizer import from_bytes

    raw = path.read_bytes()
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        likeliest = from_bytes(raw).best()
        text = NOT_TEXT if likeliest is None else str(likeliest)
    if NOT_TEXT in text:
        raise InputError("not a text file", where=str(path), fix="save it as CSV, UTF-8")
    return text


def _delimiter(header: str) -> str:
    """Found in the header alone: below it a decimal comma looks like a delimiter."""
    try:
        return csv.Sniffer().sniff(header, delimiters=DELIMITERS).delimiter
    except csv.Error:  # a single column
        return ","


def _decimal(path: Path, delimiter: str, cells: Sequence[str]) -> str:
    """Found in the cells; a comma that may set thousands apart as well is refused."""
    if delimiter == "," or any(has_decimals(cell, ".") for cell in cells):
        return "."
    commas = [cell for cell in cells if has_decimals(cell, ",")]
    if commas and all(map(may_have_thousands, commas)):
        raise InputError(
            f"{commas[0]!r} may be one and a bit, or some thousands",
            where=str(path),
            fix="write the numbers with a decimal point and without marks for thousands",
        )
    return "," if commas else "."


def _frame(path: Path, lines: list[str], delimiter: str) -> "DataFrame":
    """Texts of all lines, the header's among them; None where a line has no such cell."""
    import pandas

    if not lines:
        return pandas.DataFrame()
    try:
        return pandas.read_csv(
            io.StringIO("\n".join(lines)),
            sep=delimiter,
            header=None,
            names=list(range(max(line.count(delimiter) for line in lines) + 1)),
            dtype=object,
            keep_default_na=False,
            na_values=[],
            skip_blank_lines=False,  # a row's number is its line's
            skipinitialspace=True,
            engine="python",  # the other one does not tell a short line from empty cells
        )
    except (pandas.errors.ParserError, csv.Error) as err:
        raise InputError(
            str(err), where=str(path), fix="look for a quotation mark that is not closed"
        ) from err


def _header(cells: list[Any]) -> tuple[str, ...]:
    """Names, without those empty ones that lines beyond the header's width have made."""
    names = [_text(cell) for cell in cells if isinstance(cell, str)]
    while names and not names[-1]:
        names.pop()
    return tuple(names)


def _misfit(path: Path, line: int, row: list[Any], columns: int) -> InputError:
    """A line of fewer or more cells than its header."""
    count = sum(isinstance(cell, str) for cell in row)
    extra = "put quotation marks around a cell that holds the delimiter, or remove what is extra"
    short = "complete the line, with empty cells for what is missing"
    return InputError(
        f"{count} cells, where the header has {columns}",
        where=f"{path}: line {line}",
        fix=extra if count > columns else short,
    )


def _check_header(path: Path, header: tuple[str, ...], line: int) -> None:
    """Refuse a table that begins with its numbers."""
    if header and all(is_number(name) for name in header):
        raise InputError(
            "holds numbers, not the names of columns",
            where=f"{path}: line {line}",
            fix="write a line of names above the numbers",
        )


def is_number(text: str) -> bool:
    """Whether a cell holds a number, with either decimal sign."""
    try:
        parse_number(text.replace(",", "."))
    except ValueError:
        return False
    return True
