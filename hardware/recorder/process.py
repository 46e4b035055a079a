"""The recorder: a process that does nothing but write down the robot's samples."""

from collections.abc import Callable
from contextlib import closing
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from ..board import Board, Row, Who, host_time
from ..signals import leave_signals_to_main
from .csv_file import CsvAppender
from .disk import Disk, told_if_fails
from .events import EventLog
from .rate import Rate, counted, no_rate
from .sample import SAMPLES, Sample

HEARTBEAT = 0.04  # [s], at the longest, from one sign of life to the next
# [s]; how long the arm is followed after main has gone: a source of liquid is turned back first
LAST_SAMPLES = 5.0


def run_recorder(board: Board, samples: Connection, main: Connection, directory: Path) -> None:
    """Write what comes from `samples` to the directory's samples.csv, until main lets go.

    Where the disk takes no more, the reason goes to the events and to the board; samples are
    then read and dropped, so that the sender never waits.

    Args:
        board: Where to leave signs of life.
        samples: Gives lists of `Sample`; nobody but the control process may hold its other end.
        main: Any message or its end means: finish.
        directory: Of the session; it exists.

    Raises:
        OSError: Not even an event can be written at the start.
    """
    leave_signals_to_main()
    with closing(EventLog(directory, "recorder")) as log, told_if_fails(disk := Disk(log)):
        recorder = _Recorder(board, disk, directory)
        recorder.follow(samples, main)
        recorder.finish()
        disk.tell("left", rows=recorder.rate.total, slowest_write=disk.slowest)


class _Recorder:
    def __init__(self, board: Board, disk: Disk, directory: Path):
        self.rate: Rate = no_rate(host_time())
        self._board = board
        self._disk = disk
        self._table: CsvAppender | None = None
        self._write(lambda: self._open(directory))

    def follow(self, samples: Connection, main: Connection) -> None:
        """Record until main lets go, and then until the arm's last sample."""
        ends = [samples, main]
        deadline = float("inf")
        while host_time() < deadline and ends:
            for end in wait(ends, timeout=min(HEARTBEAT, max(deadline - host_time(), 0.0))):
                if end is samples and self._record(samples):
                    continue
                ends.remove(end)  # type: ignore[arg-type]
                if end is main:
                    deadline = host_time() + LAST_SAMPLES
                else:
                    self._disk.tell("samples_ended", rows=self.rate.total)
            if deadline < float("inf") and samples not in ends:
                return
            self._beat()

    def finish(self) -> None:
        """Bring everything to the disk."""
        table = self._table
        if table is not None:
            self._write(table.sync)
            table.close()

    def _open(self, directory: Path) -> None:
        self._table = CsvAppender(directory / SAMPLES, Sample._fields)

    def _record(self, samples: Connection) -> bool:
        """Write all that has come; false when no more will."""
        rows: list[Sample] = []
        more = _received(samples, rows.extend)
        table = self._table
        if table is not None and rows:
            self._write(lambda: table.append(rows))
        self.rate = counted(self.rate, len(rows), host_time())
        return more

    def _write(self, act: Callable[[], Any]) -> None:
        self._disk.write(SAMPLES, act)

    def _beat(self) -> None:
        now = host_time()
        self.rate = counted(self.rate, 0, now)
        row = Row(now, self._disk.trouble, self.rate.total, self.rate.rate)
        self._board.write(Who.RECORDER, row._replace(worst=self._disk.slowest))


def _received(samples: Connection, take: Callable[[list[Sample]], None]) -> bool:
    """Take what is waiting, within reason; false when the sender has gone."""
    try:
        for _ in range(100):  # a flood must not keep the recorder from its signs of life
            take(samples.recv())
            if not samples.poll():
                break
    except (EOFError, OSError):  # OSError: it was killed in the middle of a message
        return False
    return True
