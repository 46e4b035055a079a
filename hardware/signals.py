"""Signals that reach all processes of a session at once."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


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
