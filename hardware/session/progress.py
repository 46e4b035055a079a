"""How far a session has come, as its control process reports it."""

import math
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..board import Row, Who
from ..robot.orders import Began, Checked, Done, Left, Report, Stopped, Told
from ..safety.guards import Reading

POLL_SECONDS = 5e-3  # between looks while a caller waits


class SessionStopped(RuntimeError):
    """The arm was stopped for good; what was recorded is kept, and marked as aborted."""


class SessionInterrupted(SessionStopped):
    """A person stopped it by Ctrl-C."""


class Status(NamedTuple):
    """What an operator wants to know.

    Attributes:
        rows: The board's, by participant.
        readings: The guards', as of the last time that they were told.
        pose: Tool's position in the cup's frame [m] and rotation vector in the base frame, (6,).
        began: Paths that have begun, with the controller's time [s].
        done: Paths that are done, likewise.
        stopped: Why the arm was stopped; None while all is well.
        closed: Whether the session ends, or has ended.
    """

    rows: dict[Who, Row]
    readings: tuple[Reading, ...]
    pose: np.ndarray | None
    began: tuple[Began, ...]
    done: tuple[Done, ...]
    stopped: Stopped | None
    closed: bool


@dataclass
class Progress:
    """What was ordered and what was reported; written under `writing`, read from any thread.

    Attributes:
        writing: Held by whoever writes.
        checked: The pre-flight list, once it is there.
        told: The latest readings.
        began: Paths that have begun.
        done: Paths that are done.
        stopped: Why the arm was stopped for good; the first reason stays.
        left: Whether the control process ends as told.
        closing: Whether the session ends, or has ended.
        ordered: Number of paths that were ordered.
        joints: Where the latest of them ends [rad], shape (6,).
    """

    writing: AbstractContextManager = field(default_factory=threading.RLock)
    checked: Checked | None = None
    told: Told = field(default_factory=lambda: Told((), np.full(6, np.nan)))
    began: list[Began] = field(default_factory=list)
    done: list[Done] = field(default_factory=list)
    stopped: Stopped | None = None
    left: bool = False
    closing: bool = False
    ordered: int = 0
    joints: np.ndarray | None = None

    @property
    def refused(self) -> bool:
        """Whether the pre-flight list has failures, so that the control process ends."""
        return self.checked is not None and self.checked.pose is None

    @property
    def busy(self) -> bool:
        """Whether a path that was ordered is not done."""
        return len(self.done) < self.ordered

    def take(self, report: Report) -> None:
        """Note a report of the control process."""
        with self.writing:
            match report:
                case Checked():
                    self.checked = report
                case Told():
                    self.told = report
                case Began():
                    self.began.append(report)
                case Done():
                    self.done.append(report)
                case Stopped():
                    self.stopped = self.stopped or report
                case Left():
                    self.left = True

    def wait_for(self, happened: Callable[[], bool], timeout: float | None) -> None:
        """Wait until something has happened, the arm was stopped, or the time [s] is over."""
        last = math.inf if timeout is None else time.monotonic() + timeout
        # a second Ctrl-C while a condition waits would lose its lock, and raise something else
        while not (happened() or self.stopped is not None) and time.monotonic() < last:
            time.sleep(POLL_SECONDS)
