"""Where a process takes its time from: this computer's clock, or one that a test steps."""

import heapq
import itertools
import time
from collections.abc import Callable
from typing import Protocol


class HostClock(Protocol):
    """The clock that all processes of this computer share."""

    def now(self) -> float:
        """Host time [s]."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time go by; not at all if `seconds` is negative."""
        ...


class RealClock:
    """This computer's own clock."""

    def now(self) -> float:
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        time.sleep(max(seconds, 0.0))


REAL_CLOCK = RealClock()


class SteppedClock:
    """Time goes on only while somebody sleeps; what is due meanwhile happens at its moment.

    So a loop and the emulator that it commands run in one thread, as fast as the computer can,
    and the same way each time.

    Args:
        start: Host time at first [s]; not 0, which means "never" on the board.
    """

    def __init__(self, start: float = 1000.0):
        self._now = start
        # the number keeps the order of what is due at the same moment
        self._due: list[tuple[float, int, Callable[[], object], float | None]] = []
        self._numbers = itertools.count()

    def now(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        end = self._now + max(seconds, 0.0)
        while self._due and self._due[0][0] <= end:
            moment, _, act, period = heapq.heappop(self._due)
            # what sleeps within an act may have gone past the moment of the next
            self._now = max(self._now, moment)
            if period is not None:
                self._put(moment + period, act, period)
            act()
        self._now = max(self._now, end)

    def at(self, moment: float, act: Callable[[], object]) -> None:
        """Do something once, at a host time [s]."""
        self._put(moment, act, None)

    def every(self, period: float, act: Callable[[], object]) -> None:
        """Do something again and again, each `period` [s] from now on."""
        self._put(self._now + period, act, period)

    def _put(self, moment: float, act: Callable[[], object], period: float | None) -> None:
        heapq.heappush(self._due, (moment, next(self._numbers), act, period))
