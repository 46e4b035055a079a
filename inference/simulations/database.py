"""SQLite files of our own, told from all others by a digest of their tables."""

import errno
import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from zlib import crc32

from ..arguments import require

BUSY_MS = 60_000  # wait this long for another process's write


_OF_THE_DISK = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_IOERR: errno.EIO,  # so SQLite names a limit on the size of files, too
}


@contextmanager
def disk_errors(path: object) -> Iterator[None]:
    """SQLite's errors of the disk as those of Python, with the file and what to do.

    Raises:
        OSError: the disk is full or fails.
    """
    try:
        yield
    except sqlite3.OperationalError as error:
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # without its extension
        number = _OF_THE_DISK.get(code)
        if number is None:
            raise
        told = f"{error}; make room and repeat the call: what was stored is kept"
        raise OSError(number, told, str(path)) from error


def opened_database(path: object, schema: str, what: str) -> sqlite3.Connection:
    """A connection in WAL mode, where what is committed survives the death of the process.

    Args:
        path: File, created if missing; ":memory:" keeps nothing.
        schema: Statements, each ended by ";", that do nothing where they were done before. A
            digest of them is the file's `application_id`: another schema is another kind of file.
        what: Name of the content, for messages.

    Raises:
        ValueError: `path` is no path, another file, or cannot be read and written.
        OSError: the disk is full or fails.
    """
    named = isinstance(path, str | os.PathLike) and str(path)
    require(named, f"the path of a {what}", "name a file", path)
    # threads may share it, if they take turns
    options = {"timeout": BUSY_MS / 1000, "isolation_level": None, "check_same_thread": False}
    try:
        with disk_errors(path), ExitStack() as undo:
            connection = sqlite3.connect(str(path), **options)
            undo.callback(connection.close)
            _prepare(connection, schema, f"{path} is an SQLite file but not a {what}")
            undo.pop_all()
    except sqlite3.OperationalError as error:
        raise ValueError(
            f"{path} cannot be used as a {what} ({error}); give a file, in a directory that "
            "exists and can be written"
        ) from error
    except sqlite3.DatabaseError as error:
        raise ValueError(f"{path} is not a {what}; choose another file") from error
    return connection


def _prepare(connection: sqlite3.Connection, schema: str, foreign: str) -> None:
    execute, mark = connection.execute, crc32(schema.encode()) & 0x7FFFFFFF
    execute("BEGIN IMMEDIATE")  # two processes may create the file together
    found = execute("PRAGMA application_id").fetchone()[0]
    tables = execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    if found != mark and tables:
        raise ValueError(f"{foreign}; choose another file")
    execute(f"PRAGMA application_id = {mark}")
    for statement in schema.split(";")[:-1]:
        execute(statement)
    execute("COMMIT")
    write_ahead(connection)


def write_ahead(connection: sqlite3.Connection) -> None:
    """Change to WAL mode, once other connections have written.

    Raises:
        sqlite3.OperationalError: the file cannot be written, or others write for too long.
    """
    last = time.monotonic() + BUSY_MS / 1000
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
        except sqlite3.OperationalError as error:
            # SQLite does not wait here itself: it has read already which mode the file is in
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or time.monotonic() > last:
                raise
            time.sleep(0.005)
        else:
            return
