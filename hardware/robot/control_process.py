"""The control process: it alone owns the robot, and may die without taking the recording along."""

import os
import signal
import sys
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path

from ..board import Board
from ..host_clock import REAL_CLOCK, HostClock
from ..recorder.events import EventLog
from ..safety.preflight import failures
from .control_loop import ControlLoop, Links
from .orders import Assignment, Checked, Stopped, report_to
from .preparation import Prepared, others, prepare


def run_control(
    assignment: Assignment, board: Board, orders: Connection, samples: Connection
) -> None:
    """Look at the arm, and if the pre-flight list is clean and it is armed, follow orders.

    The process ends with this function.

    Args:
        assignment: What to do; without `armed` nothing can move the arm.
        board: Where the processes leave signs of life.
        orders: To main: its orders, our reports; its end stops the arm.
        samples: To the recorder; nobody else may hold this end.
    """
    log = EventLog(Path(assignment.directory), "control")
    links = Links(board, orders, samples, log, [])
    # nothing moves yet, and connecting waits for a controller that may never answer
    _on_signals(lambda *_: os._exit(1))
    code = 1
    try:
        prepared = checked(assignment, links)
        if prepared is not None:
            _on_signals(lambda number, _: links.signals.append(signal.Signals(number).name))
            code = ControlLoop(assignment, prepared, links).run()
    except Exception as err:
        log.write("failed", reason=f"{type(err).__name__}: {err}")
        report_to(orders, Stopped(f"the control process failed: {err}", "failed"))
        raise
    finally:
        sys.stderr.flush()
        # ur_rtde's destructors may wait or crash once a link was lost
        os._exit(code)


def _on_signals(act: Callable[[int, object], None]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, act)


def checked(to: Assignment, links: Links, clock: HostClock = REAL_CLOCK) -> Prepared | None:
    """Go through the pre-flight list and write it down; None unless it is clean."""
    prepared = prepare(to, partial(others, to, links.board), clock)
    checks = prepared.checks
    links.log.write("checked", checks=[list(check) for check in checks], armed=to.armed)
    failed = failures(checks)
    if not failed:
        return prepared
    links.log.write("refused", reason=failed)
    report_to(links.orders, Checked(checks, None, None))
    return None
