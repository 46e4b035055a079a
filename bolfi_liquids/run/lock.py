"""One command at a time works in a directory."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import InputError

LOCK = "run.lock"


@contextmanager
def alone_in(directory: Path) -> Iterator[None]:
    """Keep other commands out of a directory, which is made if it is missing.

    The kernel releases the lock when the process ends; the empty file remains. It is not
    re-entrant. A directory that is read-only, or on a disk without locks, is not locked.

    Raises:
        InputError: Another command works there, or it is no directory.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as err:
        fix = "choose another directory"
        raise InputError("not a directory", where=str(directory), fix=fix) from err
    if not os.access(directory, os.W_OK):
        yield
        return
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW  # a link may lead to somebody else's file
    lock = os.open(directory / LOCK, flags, 0o666)
    try:
        with suppress(OSError):
            os.fchmod(lock, 0o666)  # others of the group may work here next, whatever the umask
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                "another command works in it",
                where=str(directory),
                fix="wait until it has ended, or choose another directory",
            ) from None
        except OSError:
            pass  # a disk without locks
        yield
    finally:
        os.close(lock)
