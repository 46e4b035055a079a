"""Sending to a process that may be busy, stopped or dead, without ever waiting for it."""

import threading
from multiprocessing.connection import Connection
from typing import Any


class Outbox:
    """The newest message goes out as soon as the other end takes it; older ones are dropped."""

    def __init__(self, link: Connection):
        self._link = link
        self._newest: Any = None
        self._waiting = threading.Event()
        # a daemon: a process that never reads must not keep this one from ending
        threading.Thread(target=self._run, name="outbox", daemon=True).start()

    def put(self, message: Any) -> None:
        """Replace what was not sent yet; returns at once."""
        self._newest = message
        self._waiting.set()

    def _run(self) -> None:
        while self._waiting.wait():
            self._waiting.clear()
            try:
                self._link.send(self._newest)
            except (OSError, ValueError):  # closed at either end: whoever reads it finds out
                return
