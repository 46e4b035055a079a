"""samples.csv: what is recorded of the robot at each tick, and the process that writes it down."""

from collections.abc import Iterator
from functools import partial
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import NamedTuple

from ..board import Board, Row, Who, host_time
from ..csv_file import CsvAppender
from ..process import leave_signals_to_main
from .events import Disk, writing

SAMPLES = "samples.csv"
HEARTBEAT = 0.04  # [s], at the longest, from one sign of life to the next
# [s]; how long the arm is followed after main has gone: a source of liquid is turned back first
LAST_SAMPLES = 5.0


class Sample(NamedTuple):
    """The robot at one tick of the motion loop.

    Attributes:
        index: Of the tick, without gaps.
        time: The controller's clock [s].
        host: The host's clock when it was read [s].
        x: Tool's centre in the cup's frame [m], as are `y` and `z`.
        rx: Its rotation vector in the base frame [rad], as are `ry` and `rz`.
        target_x: Where it was told to be [m]; NaN while nothing is commanded.
        fx: Force on the tool in the base frame [N], as are `fy` and `fz`.
        speed_scaling: The controller's, 1 at full speed.
        safety_bits: The controller's safety status.
        runtime_state: 2 while its program runs.
        stirring: 1 while the path belongs to the stir, 0 on the way there and back.
        late: By which the tick came late [s].
    """

    index: int  # pyright: ignore[reportIncompatibleMethodOverride]
    time: float
    host: float
    x: float
    y: float
    z: float
    rx: float
    ry: float
    rz: float
    target_x: float
    target_y: float
    target_z: float
    fx: float
    fy: float
    fz: float
    speed_scaling: float
    safety_bits: int
    runtime_state: int
    stirring: int
    late: float


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
    with writing(directory, "recorder") as disk:
        table = disk.write(SAMPLES, lambda: CsvAppender(directory / SAMPLES, Sample._fields))
        begun, count = 0.0, 0
        for rows in _arriving(samples, main, disk):
            if table is not None and rows:
                disk.write(SAMPLES, partial(table.append, rows))
            if rows and not count:
                begun = rows[0].host
            now, count = host_time(), count + len(rows)
            rate = count / max(now - begun, HEARTBEAT)
            board.write(Who.RECORDER, Row(now, disk.trouble, count, rate, worst=disk.slowest))
        if table is not None:
            disk.write(SAMPLES, table.sync)
            table.close()
        disk.tell("left", rows=count, slowest_write=disk.slowest)


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
