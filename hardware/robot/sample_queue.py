"""Samples on their way to the recorder, which may be slow or dead; the motion loop never waits."""

import select
from collections import deque
from multiprocessing.connection import Connection

from ..recorder.sample import Sample

SAMPLES_PER_MESSAGE = 5  # samples a message
# what a pipe takes at once where it takes anything is 4096 bytes; a sample needs about 250
MAX_SAMPLES_AT_ONCE = 12


class Outlet:
    """Hands batches on while the pipe takes them, and keeps the rest.

    Attributes:
        gone: Whether the recorder has closed its end.
    """

    def __init__(self, samples: Connection):
        self._samples = samples
        self._waiting: deque[Sample] = deque()
        self.gone = False

    @property
    def waiting(self) -> int:
        """Samples that the recorder has not taken."""
        return len(self._waiting)

    def put(self, sample: Sample) -> None:
        """Take a sample; every few of them go on."""
        self._waiting.append(sample)
        if len(self._waiting) >= SAMPLES_PER_MESSAGE:
            self.flush()

    def flush(self) -> None:
        """Hand on what the pipe takes without waiting."""
        while self._waiting and not self.gone:
            if not select.select([], [self._samples], [], 0.0)[1]:
                return
            count = min(MAX_SAMPLES_AT_ONCE, len(self._waiting))
            batch = [self._waiting.popleft() for _ in range(count)]
            try:
                self._samples.send(batch)
            except OSError:
                self.gone = True
