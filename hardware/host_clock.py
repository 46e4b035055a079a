"""Where a process takes its time from: this computer's clock, or one like it."""

import time
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
