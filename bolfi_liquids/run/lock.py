"""One command at a time works in a directory."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError

try:
    import fcntl
except ModuleNotFoundError:  # Windows: nothing keeps a second command out
    fcntl = None

LOCK = "run.lock"


@contextmanager
def alone_in(directory: Path) -> Iterator[None]:
    """Keep other commands out of a directory, which is made if it is missing.

    The lock belongs to the process and ends with it, however it ends; its empty file stays. It is
    not re-entrant.

    Raises:
        InputError: Another command works there, or it is no directory.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as err:
        fix = "choose another directory"
        raise InputError("not a directory", where=str(directory), fix=fix) from err
    with open(directory / LOCK, "a", encoding="utf-8") as lock:
        try:
            if fcntl is not None:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                "another command works in it",
                where=str(directory),
                fix="wait until it has ended, or choose another directory",
            ) from None
        yield
