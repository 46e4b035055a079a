"""The processes of a session: started together, supervised by a thread, ended together."""

import math
import signal
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..board import SPAWN, Board, Row, Who, host_time
from ..cameras.base import FrameSource
from ..recorder.events import EventLog
from ..recorder.samples import run_recorder
from ..rig import View
from ..robot.control_loop import run_control
from ..robot.orders import (
    Assignment,
    Began,
    Checked,
    Done,
    Left,
    Order,
    Report,
    Stop,
    Stopped,
    Told,
)
from ..safety.guards import Reading
from .camera_process import run_camera

POLL_SECONDS = 5e-3  # between looks while a caller waits
MAX_SILENCE = 1.0  # s, after which a control process without a sign of life is ended
SUPERVISION_PERIOD = 0.1  # s, at the longest, from one look to the next
LET_END = 0.8  # s, for which a child may end by itself
TERMINATE_SECONDS = 0.1  # s, from the request to end to the end by force


class SessionStopped(RuntimeError):
    """The arm was stopped for good; what was recorded is kept, and marked as aborted."""


class SessionInterrupted(SessionStopped):
    """A person stopped it by Ctrl-C."""


class Status(NamedTuple):
    """State of a session for its operator.

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
    """Orders and reports of a session; written under `writing`, read from any thread.

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


class Child(NamedTuple):
    """A process of a session.

    Attributes:
        name: As an operator reads it.
        process: Of the system.
        link: Main's end of the pipe whose end tells the child that main is gone.
    """

    name: str
    process: BaseProcess
    link: Connection


def start(
    name: str, target: Callable[..., None], args: Callable[[Connection], tuple[Any, ...]]
) -> Child:
    """Spawn a child; `args` makes its arguments from its end of the pipe to main."""
    mine, its = SPAWN.Pipe()
    process = SPAWN.Process(target=target, args=args(its), name=name, daemon=True)
    process.start()
    # the child sees the pipe's end only if nobody else holds this side of it
    its.close()
    return Child(name, process, mine)


def ended_how(child: Child) -> str:
    """End of a process that is no more, in words."""
    code = child.process.exitcode
    if code is not None and code < 0:
        return f"{child.name} process killed by {signal.Signals(-code).name}"
    return f"{child.name} process ended by itself with exit code {code}"


def tell_to_leave(child: Child) -> None:
    """Ask a child to finish; it may be gone already."""
    try:
        child.link.send("leave")
    except OSError:
        pass


def end(children: list[Child], patience: float = LET_END) -> list[Child]:
    """Wait for children, then end those that remain by force.

    Returns:
        Those that had to be ended.
    """
    deadline = host_time() + patience
    for child in children:
        child.process.join(max(deadline - host_time(), 0.0))
    stubborn = [child for child in children if child.process.is_alive()]
    for child in stubborn:
        child.process.terminate()
    deadline = host_time() + TERMINATE_SECONDS
    for child in stubborn:
        child.process.join(max(deadline - host_time(), 0.0))
        if child.process.is_alive():
            child.process.kill()
            child.process.join()
    return stubborn


class Processes:
    """Recorder, cameras and control process of a session.

    Args:
        board: On which they show signs of life.
        log: Of the main process.
        progress: Takes what the control process reports, and why the arm was stopped.
    """

    def __init__(self, board: Board, log: EventLog, progress: Progress):
        self.children: list[Child] = []
        self.control: Child | None = None
        self._board = board
        self._log = log
        self._progress = progress
        self._sending = threading.Lock()
        self._supervisor: threading.Thread | None = None

    def start(
        self, assignment: Assignment, make_cameras: Mapping[View, Callable[[], FrameSource]]
    ) -> None:
        """Start them all; those that were started before an error are among `children`."""
        board, directory = self._board, Path(assignment.directory)
        reading, writing = SPAWN.Pipe(duplex=False)
        try:
            self.children.append(
                start("recorder", run_recorder, lambda link: (board, reading, link, directory))
            )
            for view, make in make_cameras.items():
                self.children.append(self._start_camera(assignment, view, make))
            self.control = start(
                "control", run_control, lambda link: (assignment, board, link, writing)
            )
            self.children.append(self.control)
        finally:
            # the recorder sees the samples' end only if nobody else can write any
            reading.close()
            writing.close()

    def _start_camera(
        self, assignment: Assignment, view: View, make: Callable[[], FrameSource]
    ) -> Child:
        rig, board, directory = assignment.rig, self._board, Path(assignment.directory)
        return start(
            f"camera {view}", run_camera, lambda link: (rig, view, make, board, link, directory)
        )

    def supervise(self) -> None:
        """Take reports and notice deaths from now on, in a thread."""
        self._supervisor = threading.Thread(target=self._supervise, name="supervisor", daemon=True)
        self._supervisor.start()

    def send(self, order: Order) -> bool:
        """Tell the control process; false where there is none any more."""
        if self.control is None:
            return False
        try:
            with self._sending:
                self.control.link.send(order)
        except OSError:
            return False
        return True

    def stop(self, stopped: Stopped) -> None:
        """Stop the arm and write the reason down, if there is none yet."""
        self.send(Stop(stopped.reason))
        with self._progress.writing:
            if self._progress.stopped is None:
                self._progress.stopped = stopped
                self._log.write("stopped", guard=stopped.guard, reason=stopped.reason)

    def end(self, last: Order, patience: float) -> None:
        """End them all: the control process by its last order, within so many seconds."""
        if self.control is not None:
            self.send(last)
            self.control.process.join(patience)
        for child in self.children:
            if child is not self.control:
                tell_to_leave(child)
        for child in end(self.children):
            self._log.write("ended_by_force", process=child.name)
        if self._supervisor is not None:
            self._supervisor.join()
        for child in self.children:
            child.link.close()

    # -- the supervisor's thread

    def _supervise(self) -> None:
        """Take reports and notice deaths, until all children are gone."""
        assert self.control is not None
        link: Any = self.control.link
        alive = {child.process.sentinel: child for child in self.children}
        while alive:
            sources = [*alive, link] if link is not None else [*alive]
            self._end_if_silent(self.control)
            for ready in wait(sources, timeout=SUPERVISION_PERIOD):
                if ready is link:
                    link = link if self._take_report() else None
                elif isinstance(ready, int):
                    child = alive.pop(ready)
                    child.process.join()
                    if child is self.control and link is not None:
                        while link.poll() and self._take_report():
                            pass
                        link = None
                    self._notice_end(child)

    def _take_report(self) -> bool:
        """Take one report of the control process; false when there will be no more."""
        assert self.control is not None
        try:
            report = self.control.link.recv()
        except (EOFError, OSError):
            return False
        self._progress.take(report)
        return True

    def _end_if_silent(self, control: Child) -> None:
        """A control process that hangs keeps no watchdog quiet, and is of no more use."""
        row = self._board.read(Who.CONTROL)
        over = self._progress.left or not row.beat or not control.process.is_alive()
        if over or row.age(host_time()) <= MAX_SILENCE:
            return
        control.process.kill()
        reason = f"no sign of life of the control process for {MAX_SILENCE} s"
        self.stop(Stopped(reason, "control"))

    def _notice_end(self, child: Child) -> None:
        progress = self._progress
        is_control = child is self.control
        over = progress.left or progress.refused or progress.stopped is not None
        if progress.closing or (is_control and over):
            return
        self.stop(Stopped(ended_how(child), child.name))
