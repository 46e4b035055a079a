"""A clock that a test steps, in place of the computer's own."""

import heapq
import itertools
from collections.abc import Callable


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
