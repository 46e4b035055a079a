"""A process's dealings with a disk that may get full: it stops writing and goes on living."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from ..board import Trouble, host_time
from .events import FULL, EventLog


class Disk:
    """Carries out writes until one fails; tells the reason once, and writes no more.

    Attributes:
        trouble: What to complain of on the board.
        slowest: Longest time that a write has taken [s].
    """

    def __init__(self, log: EventLog):
        self.trouble = Trouble.NONE
        self.slowest = 0.0
        self._log = log

    def write[T](self, name: str, act: Callable[[], T]) -> T | None:
        """Write to the file `name` by `act`; returns its result, None once a write has failed."""
        if self.trouble is Trouble.WRITE_FAILED:
            return None
        start = host_time()
        try:
            return act()
        except OSError as err:
            self.trouble = Trouble.WRITE_FAILED
            cure = " (make room)" if err.errno in FULL else ""
            reason = f"{name}: {err.strerror or err}{cure}"
            self.tell(self.trouble.kind, file=name, reason=reason)
        finally:
            self.slowest = max(self.slowest, host_time() - start)
        return None

    def tell(self, kind: str, **fields: Any) -> None:
        """Write an event, if it can be written at all; the board tells of trouble besides."""
        with suppress(OSError):
            self._log.write(kind, **fields)


@contextmanager
def told_if_fails(disk: Disk) -> Iterator[None]:
    """Leave the reason in the events when a process ends by an error."""
    try:
        yield
    except Exception as err:
        disk.tell("failed", reason=f"{type(err).__name__}: {err}")
        raise
