"""Signs of life that the processes of a session leave for each other, in shared memory.

Each participant writes its own row only. A number is one aligned double, so that a reader sees
the old value or the new one; rows need no lock, and nobody waits for a process that has died.
"""

from ctypes import c_double
from enum import IntEnum
from multiprocessing import current_process, get_context
from typing import Any, NamedTuple

from .process import REAL_CLOCK

SPAWN = get_context("spawn")  # a fork would copy threads and open sockets of JAX and RTDE


def check_can_start() -> None:
    """Refuse to start processes from a script that is being imported by one of them.

    Raises:
        RuntimeError: It is.
    """
    if getattr(current_process(), "_inheriting", False):
        raise RuntimeError(
            "a script that starts a session is imported again by each of its processes: put what "
            "it does under `if __name__ == '__main__':`"
        )


class Who(IntEnum):
    """A participant, by the number of its row."""

    CONTROL = 0
    RECORDER = 1
    CAMERA_XZ = 2
    CAMERA_YZ = 3

    @property
    def label(self) -> str:
        """As a person reads it."""
        return self.name.lower().replace("_", " ")


class Trouble(IntEnum):
    """Trouble of a participant."""

    NONE = 0
    WRITE_FAILED = 1
    SOURCE_LOST = 2
    SAME_PICTURE = 3
    STOPPED = 4
    BAD_STAMPS = 5

    @property
    def kind(self) -> str:
        """Kind of the event that tells of it."""
        return self.name.lower()


class Row(NamedTuple):
    """One participant's signs of life.

    Attributes:
        beat: Host time of the last one [s]; 0 before the first.
        trouble: A `Trouble`.
        count: Pictures read, rows written or ticks made.
        rate: Of them, per second; of a camera over the last two seconds, of others since the first.
        value: Control: progress through the plan in [0, 1]; a camera: the angle it sees [rad].
        worst: Control: greatest lateness of a tick [s]; a camera: greatest age of a picture [s].
    """

    beat: float = 0.0
    trouble: float = 0.0
    count: float = 0.0  # pyright: ignore[reportIncompatibleMethodOverride]
    rate: float = 0.0
    value: float = float("nan")
    worst: float = 0.0

    def age(self, now: float) -> float:
        """Since the last sign of life [s]; infinite before the first."""
        return now - self.beat if self.beat else float("inf")


WIDTH = len(Row._fields)


class Board:
    """The shared rows; it may be given to a spawned process as an argument."""

    def __init__(self) -> None:
        self._memory: Any = SPAWN.RawArray(c_double, WIDTH * len(Who))
        for who in Who:
            self.write(who, Row())

    def write(self, who: Who, row: Row) -> None:
        """Replace one participant's row; for that participant alone."""
        at = WIDTH * who
        # the beat goes last: whoever sees it fresh sees the rest as fresh
        self._memory[at + 1 : at + WIDTH] = row[1:]
        self._memory[at] = row.beat

    def read(self, who: Who) -> Row:
        """One participant's row."""
        at = WIDTH * who
        return Row(*self._memory[at : at + WIDTH])


def host_time() -> float:
    """The clock that all processes of this computer share [s]."""
    return REAL_CLOCK.now()
