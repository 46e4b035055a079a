"""Messages of which only the newest counts; the sender never waits for the reader."""

import os
import socket
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any


class Outbox:
    """The newest message goes out as soon as the other end takes it; older ones are dropped.

    Args:
        link: Of a duplex pipe; nothing else may send through it, or close it.
    """

    def __init__(self, link: Connection):
        self._link = link
        self._newest: Any = None
        self._waiting = threading.Event()
        # a daemon: a process that never reads must not keep this one from ending
        self._thread = threading.Thread(target=self._run, name="outbox", daemon=True)
        self._thread.start()

    def put(self, message: Any) -> None:
        """Replace what was not sent yet; returns at once."""
        self._newest = message
        self._waiting.set()

    def close(self) -> None:
        """Close the link, whether or not the other end reads; closing twice does no harm."""
        if self._link.closed:
            return
        # ends a pending send, which closing would not; a closed number may be reused
        with socket.socket(fileno=os.dup(self._link.fileno())) as both, suppress(OSError):
            both.shutdown(socket.SHUT_RDWR)
        self.put(None)
        self._thread.join()
        self._link.close()

    def _run(self) -> None:
        while self._waiting.wait():
            self._waiting.clear()
            try:
                self._link.send(self._newest)
            except OSError:  # closed at either end: the reader gets an error of its own
                return


def newest(link: Connection) -> Any:
    """Wait for a message; if several have come, the last of them.

    Raises:
        EOFError: The other end was closed, perhaps in the middle of a message.
    """
    try:
        message = link.recv()
        while link.poll():
            message = link.recv()
    except OSError as err:
        raise EOFError("the sender has gone") from err
    return message
