"""Clock, priority and signals of the processes of a session."""

import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

FIFO_PRIORITY = 20
CONTROL_NICENESS = -10
BEFORE_OTHERS = -5
SWITCH_INTERVAL = 5e-4  # s; the thread that checks orders must not hold up the loop


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


def come_first() -> None:
    """Ask for a better priority than that of what may wait, such as inference; if permitted."""
    try:
        os.nice(BEFORE_OTHERS)
    except OSError:
        pass


def quieten() -> None:
    """Keep Python's own pauses away; takes some hundredths of a second."""
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(SWITCH_INTERVAL)


def hurry() -> str:
    """Ask for a real-time or a better priority for this thread.

    Not to be called before ur_rtde has nothing to wait for: it waits without sleeping.

    Returns:
        What was granted: "fifo", "nice" or "normal".
    """
    try:
        # threads that this one starts must not inherit it
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(FIFO_PRIORITY))
        return "fifo"
    except (OSError, AttributeError):  # not permitted; or a system without it
        pass
    try:
        os.nice(CONTROL_NICENESS)
        return "nice"
    except OSError:
        return "normal"


def leave_signals_to_main() -> None:
    """Ignore what a terminal sends to all: main decides, and the end of its pipe means: finish."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def ignored_interrupts() -> Iterator[None]:
    """Ctrl-C does nothing meanwhile, here and in processes that are started.

    Only a process's main thread can choose that; in others this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
