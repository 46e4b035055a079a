"""The recorder: a process that does nothing but write down the robot's samples."""

from collections.abc import Iterator
from contextlib import closing
from functools import partial
from multiprocessing.connection import Connection, wait
from pathlib import Path

from ..board import Board, Row, Who, host_time
from ..csv_file import CsvAppender
from ..signals import leave_signals_to_main
from .disk import Disk, told_if_fails
from .events import EventLog
from .rate import counted, no_rate
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
        table = disk.write(SAMPLES, lambda: CsvAppender(directory / SAMPLES, Sample._fields))
        rate = no_rate(host_time())
        for rows in _arriving(samples, main, disk):
            if table is not None and rows:
                disk.write(SAMPLES, partial(table.append, rows))
            now = host_time()
            rate = counted(rate, len(rows), now)
            row = Row(now, disk.trouble, rate.total, rate.rate, worst=disk.slowest)
            board.write(Who.RECORDER, row)
        if table is not None:
            disk.write(SAMPLES, table.sync)
            table.close()
        disk.tell("left", rows=rate.total, slowest_write=disk.slowest)


def _arriving(samples: Connection, main: Connection, disk: Disk) -> Iterator[list[Sample]]:
    """Yield each heartbeat's samples, until main lets go and the arm has sent its last one."""
    ends = [samples, main]
    deadline = float("inf")
    while host_time() < deadline and ends:
        rows: list[Sample] = []
        for end in wait(ends, timeout=min(HEARTBEAT, max(deadline - host_time(), 0.0))):
            if end is samples and _received(samples, rows):
                continue
            ends.remove(end)  # type: ignore[arg-type]
            if end is main:
                deadline = host_time() + LAST_SAMPLES
            else:
                disk.tell("samples_ended")
        yield rows
        if deadline < float("inf") and samples not in ends:
            return


def _received(samples: Connection, rows: list[Sample]) -> bool:
    """Add what is waiting to `rows`, within reason; false when the sender has gone."""
    try:
        for _ in range(100):  # a flood must not keep the recorder from its signs of life
            rows.extend(samples.recv())
            if not samples.poll():
                break
    except (EOFError, OSError):  # OSError: it was killed in the middle of a message
        return False
    return True
