"""Tables that grow while something happens, and that survive the death of their writer."""

import errno
import os
from collections.abc import Sequence
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
from numpy.typing import NDArray

SYNC_INTERVAL = 1.0  # [s]; what a loss of power may cost


class BackgroundSync:
    """Brings a file to the disk every `SYNC_INTERVAL`, in a thread.

    A disk may take some tenths of a second, in which a camera's process would look dead.

    Args:
        file: Descriptor; it is duplicated, and stays the writer's.
    """

    def __init__(self, file: int):
        self._file = os.dup(file)
        self._over = Event()
        self._error: OSError | None = None
        self._thread = Thread(target=self._run, name="sync", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Tell the writer of what went wrong since.

        Raises:
            OSError: The disk did not take what was written.
        """
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End the thread; may be called again."""
        if not self._over.is_set():
            self._over.set()
            self._thread.join()
            os.close(self._file)

    def _run(self) -> None:
        while self._error is None and not self._over.wait(SYNC_INTERVAL):
            try:
                os.fsync(self._file)
            except OSError as err:
                self._error = err


class CsvAppender:
    """Appends rows to a new table; whatever was appended outlives this process.

    The rows of one call go to the file by one `write`. A loss of power costs what came in the
    last second, as `BackgroundSync` says.

    Raises:
        OSError: The file holds something already, or it cannot be written.
    """

    def __init__(self, path: Path, fields: Sequence[str]):
        self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            if os.fstat(self._file).st_size > 0:
                raise FileExistsError(errno.EEXIST, "holds something already", str(path))
            write_all(self._file, (",".join(fields) + "\n").encode())
        except OSError:
            os.close(self._file)
            raise
        self._sync = BackgroundSync(self._file)

    def append(self, rows: Sequence[Sequence[float]]) -> None:
        """Write rows of numbers, as many as there are fields each.

        Raises:
            OSError: The file cannot take them, and a part of the last row may be in it; or the
                disk did not take earlier ones.
        """
        if rows:
            write_all(self._file, "".join(map(_line, rows)).encode())
        self._sync.check()

    def sync(self) -> None:
        """Bring what was written to the disk.

        Raises:
            OSError: The disk does not take it.
        """
        os.fsync(self._file)

    def close(self) -> None:
        """Close the file; may be called again."""
        if self._file >= 0:
            self._sync.close()
            os.close(self._file)
            self._file = -1


def write_all(file: int, data: bytes) -> None:
    """Write all of `data`; a disk that gets full takes a part first, and then says why.

    Raises:
        OSError: The file cannot take all.
    """
    written = os.write(file, data)
    while written < len(data):
        written += os.write(file, data[written:])


def _line(row: Sequence[float]) -> str:
    return ",".join(map(_number, row)) + "\n"


def _number(value: Any) -> str:
    # float's text gives the same double back; NumPy's own would name its type
    return str(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


def read_csv(path: Path, fields: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """The columns of a table that a `CsvAppender` wrote, each of shape (N,).

    A row that is cut off or damaged is left out, which pandas could not tell from a missing value.
    A file without rows gives empty columns.

    Raises:
        OSError: There is no such file.
        ValueError: The file's header has other fields.
    """
    lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
    if len(lines) < 2:  # not even a whole header
        return {name: np.empty(0) for name in fields}
    if lines[0] != ",".join(fields):
        raise ValueError(f"{path}: has the fields {lines[0]:.200}, not {','.join(fields)}")
    rows = [row for line in lines[1:-1] if len(row := _numbers(line)) == len(fields)]
    table = np.array(rows, dtype=float).reshape(len(rows), len(fields))
    return {name: table[:, k] for k, name in enumerate(fields)}


def _numbers(line: str) -> list[float]:
    try:
        return [float(value) for value in line.split(",")]
    except ValueError:  # zeros that a loss of power left
        return []
