"""One command at a time enters a RUN directory."""

import errno
import json
import os
import platform
import stat
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import disk_errno
from .directory import GIVEN_POURS, RUN_TOML, SIMULATIONS, enter_run, open_bank, read_run
from .recordings import RECORDINGS_FOLDER

try:
    import fcntl
except ModuleNotFoundError:  # Windows: only new runs are protected, by run.toml, made once
    fcntl = None

LOCK = "run.lock"
# no link is followed: what it leads to may be a file of somebody else
LOCK_FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
LOCK_TRIES = 100  # each lost to a command that ended at this very moment
NAME_SECONDS = 5.0  # that a command may take to write its name into the lock that it holds


@contextmanager
def entered(
    run: Path, record: Mapping[str, Any], *, resume: bool, growing: str = ""
) -> Iterator[list[str]]:
    """Work in a run, new or resumed, alone; see `enter_run` for the arguments.

    A run that begins here and is refused before its first simulation leaves nothing behind.

    Yields:
        Names of the conclusions that were removed.

    Raises:
        InputError: Another command works in the directory, or `enter_run` refuses it.
    """
    with working_in(run):
        before = set(_own_files(run))
        removed = enter_run(run, record, resume=resume, growing=growing)
        try:
            yield removed
        except (ValueError, OSError) as err:
            # where the disk is full the same run goes on later, with --resume
            if disk_errno(err) is None and run / RUN_TOML not in before and not _has_simulated(run):
                _remove(run, set(_own_files(run)) - before)
            raise


@contextmanager
def working_in_run(run: Path) -> Iterator[None]:
    """Keep other commands out of a run that is there, while its files are read and written.

    Raises:
        InputError: There is no run, or another command works in it.
    """
    read_run(run)  # first, for `working_in` makes the directory of a mistyped name
    with working_in(run):
        yield


@contextmanager
def working_in(directory: Path) -> Iterator[None]:
    """Keep other commands out of a directory, which is made if it is missing.

    The lock belongs to the process and ends with it, however it ends. It is not re-entrant: one
    command calls another before or after its own work, never within. A directory that was made
    here and is still empty afterwards is removed. On a disk without locks, and on Windows, only a
    new run is protected: its run.toml is made once.

    Raises:
        InputError: Another command works in it, here or on another computer that shares the disk;
            or it is no directory.
    """
    missing = [one for one in (directory, *directory.parents) if not one.exists()]
    lock = None
    try:
        lock = _locked(directory)
        yield
    finally:
        if lock is not None:
            with suppress(OSError):
                (directory / LOCK).unlink()  # while it is held: `_locked` looks whether it is there
            os.close(lock)
        for one in missing:
            with suppress(OSError):
                one.rmdir()


def _locked(directory: Path) -> int | None:
    """Descriptor of the lock; None where the directory is read-only, for nothing changes there."""
    path = directory / LOCK
    for _ in range(LOCK_TRIES):
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, FileNotFoundError, NotADirectoryError) as err:
            if any(map(_is_in_the_way, (directory, *directory.parents))):
                fix = "choose another directory"
                raise InputError("not a directory", where=str(directory), fix=fix) from err
            continue  # whoever made it, or its parent, has just removed it
        try:
            lock = os.open(path, LOCK_FLAGS, 0o666)
        except FileNotFoundError:
            continue  # whoever made the directory has just removed it
        except OSError as err:
            refused = isinstance(err, PermissionError) or err.errno == errno.EROFS
            if not refused or os.access(directory, os.W_OK):  # then the lock is another user's
                raise
            return None
        try:
            if _taken(lock, path):
                _sign(lock, path)
                return lock
        except BaseException:
            os.close(lock)
            raise
        os.close(lock)
    raise InputError(
        "no file can be made there, or other commands keep coming and going",
        where=str(path),
        fix="choose another directory, or repeat the command",
    )


def _is_in_the_way(path: Path) -> bool:
    """Whether something else than a directory, such as a link to nothing, has this name."""
    try:
        return not stat.S_ISDIR(path.stat().st_mode)
    except OSError:
        return path.is_symlink()


def _taken(lock: int, path: Path) -> bool:
    """Whether the lock is ours now; False if the file was removed meanwhile.

    Raises:
        InputError: It is another command's.
    """
    if fcntl is not None:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise _occupied(path) from None
        except OSError:
            pass  # a disk without locks: only new runs are protected, by run.toml, made once
    try:
        there = os.stat(path)
    except FileNotFoundError:
        return False
    return os.path.samestat(there, os.fstat(lock))


def _sign(lock: int, path: Path) -> None:
    """Write into the lock who holds it.

    Raises:
        OSError: The disk is full; the lock is removed, and its file is named.
    """
    who = {"process": os.getpid(), "host": platform.node() or "an unnamed host"}
    now = datetime.now(UTC).isoformat(timespec="seconds")
    # it is another user's, left by a command that was killed; or disk or system have no modes
    with suppress(OSError, AttributeError):
        os.fchmod(lock, 0o666)  # others of the group may work here next, whatever the umask
    try:
        os.ftruncate(lock, 0)
        os.pwrite(lock, json.dumps({**who, "since": now}).encode(), 0)
    except OSError as err:
        with suppress(OSError):
            path.unlink()
        raise OSError(err.errno, err.strerror, str(path)) from err


def _occupied(path: Path) -> InputError:
    """A refusal that names who works there."""
    named: dict[str, Any] = {}
    deadline = time.monotonic() + NAME_SECONDS
    while not named and time.monotonic() < deadline:
        with suppress(OSError, ValueError):
            named = json.loads(path.read_text(encoding="utf-8"))
        time.sleep(0.01)
    who = "another process works in it"
    if named:
        who = "process {process} on {host} has worked in it since {since}".format_map(named)
    return InputError(
        who,
        where=str(path.parent),
        fix="wait until it has ended, or choose another directory; a calibration that was stopped "
        "goes on with --resume",
    )


def _own_files(run: Path) -> list[Path]:
    """What a run has before its first result."""
    own = (RUN_TOML, GIVEN_POURS, f"{SIMULATIONS}*", f"{RECORDINGS_FOLDER}/*")
    return [path for pattern in own for path in run.glob(pattern)]


def _has_simulated(run: Path) -> bool:
    if not (run / SIMULATIONS).exists():
        return False
    try:
        with open_bank(run) as bank:
            return len(bank) > 0
    except (ValueError, OSError):
        return True  # what cannot be read is left alone


def _remove(run: Path, made: set[Path]) -> None:
    for path in made:
        with suppress(OSError):
            path.unlink()
    with suppress(OSError):  # it holds what is not ours
        (run / RECORDINGS_FOLDER).rmdir()
