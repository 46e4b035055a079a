"""Files brought to the disk beside their writer, which must not wait for it."""

import os
from threading import Event, Thread

SYNC_INTERVAL = 1.0  # [s]; what a loss of power may cost


class BackgroundSync:
    """Brings a file to the disk every `SYNC_INTERVAL`, in a thread.

    A disk may take some tenths of a second, in which a camera's process would look dead.

    Args:
        file: Descriptor; it is duplicated, and stays the writer's.
    """

    def __init__(self, file: int):
        self._file = os.dup(file)
        self._over = Event()
        self._error: OSError | None = None
        self._thread = Thread(target=self._run, name="sync", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Tell the writer of what went wrong since.

        Raises:
            OSError: The disk did not take what was written.
        """
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End the thread; may be called again."""
        if not self._over.is_set():
            self._over.set()
            self._thread.join()
            os.close(self._file)

    def _run(self) -> None:
        while self._error is None and not self._over.wait(SYNC_INTERVAL):
            try:
                os.fsync(self._file)
            except OSError as err:
                self._error = err
