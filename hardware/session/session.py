"""A session: the processes around one recording, started, supervised and ended by main."""

import atexit
import signal
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np

from ..board import SPAWN, Board, Row, Who, check_can_start, host_time
from ..cameras.base import Camera
from ..errors import MotionRejected, RigError
from ..motion.cup_frame import cup_frame
from ..motion.stir_paths import PosePath
from ..recorder.directory import start_directory
from ..recorder.events import EventLog, drop_reserve
from ..recorder.process import run_recorder
from ..rig import Rig, View
from ..robot.control_process import run_control
from ..robot.orders import (
    Ask,
    Assignment,
    Began,
    Checked,
    Done,
    Follow,
    Leave,
    Left,
    Order,
    Stop,
    Stopped,
    Told,
)
from ..safety.guards import Reading
from ..safety.limits import Tool, check_path
from ..safety.preflight import Check, failures
from ..signals import ignored_interrupts
from .camera_process import run_camera
from .children import Child, end, ended_how, start, tell_to_leave
from .confirmation import Confirmation
from .patience import patient

ENDINGS = (signal.SIGTERM, signal.SIGHUP)  # Ctrl-C raises KeyboardInterrupt already
PREFLIGHT = 30.0  # s, until the pre-flight list must be there
PROBES = 60  # poses of the plan about which the controller's own limits are asked
# s, until the arm must be at rest and its process gone; a source is turned back upright first
CONTROL_ENDS = {"stirring": 0.7, "pouring": 5.0}
SILENT = 1.0  # s, after which a control process without a sign of life is ended
SUPERVISED = 0.1  # s, at the longest, from one look to the next


class Status(NamedTuple):
    """What an operator wants to know.

    Attributes:
        rows: The board's, by participant.
        readings: The guards', as of the last time that they were told.
        pose: Tool's position in the cup's frame [m] and rotation vector in the base frame, (6,).
        began: Paths that have begun, with the controller's time [s].
        done: Paths that are done, likewise.
        stopped: Why the arm was stopped; None while all is well.
    """

    rows: dict[Who, Row]
    readings: tuple[Reading, ...]
    pose: np.ndarray | None
    began: tuple[Began, ...]
    done: tuple[Done, ...]
    stopped: Stopped | None


class SessionStopped(RuntimeError):
    """The arm was stopped for good; what was recorded is kept, and marked as aborted."""


class Session:
    """One recording; a context manager. A dry run unless it is armed.

    A dry run looks at the arm and records where it is; it opens no connection that could move it.

    Args:
        rig: What is there.
        directory: Of the recording; new or empty.
        address: Of the controller; the rig's own if None.
        make_cameras: By view, what opens its camera in the process that reads it; both or none.
        tool: What is in the gripper.
        armed: Whether the arm may move.
        confirmation: What a person has typed after reading the plan; needed if armed.
        plan: What will be followed; the controller's own safety limits are asked about it.
        rehearsal: Whether stalls of this computer are borne, as `patient` says; for an emulated
            arm only.
        source: Where the data come from, for the recording.

    Raises:
        RigError: Armed without a confirmation for this controller, or the directory cannot be
            used.
    """

    def __init__(  # noqa: PLR0913  a rig has that many parts
        self,
        rig: Rig,
        directory: Path,
        address: str | None = None,
        make_cameras: Mapping[View, Callable[[], Camera]] | None = None,
        *,
        tool: Tool = "stirring",
        armed: bool = False,
        confirmation: Confirmation | None = None,
        plan: Sequence[PosePath] = (),
        rehearsal: bool = False,
        source: str = "robot",
    ):
        check_can_start()
        self.board = Board()
        self._armed = armed
        self._address = rig.robot.host if address is None else address
        _check_confirmation(self._address, armed, confirmation)
        if rehearsal:
            _check_rehearsal(confirmation)
        # copies of a rig may hold numbers that its file may not
        rig = Rig.model_validate(rig.model_dump())
        self.rig = patient(rig) if rehearsal else rig
        self._frame = cup_frame(rig.cup)
        duration = sum(path.duration for path in plan)
        extra = {"source": source, "tool": tool, "rehearsal": rehearsal}
        self._make_cameras = dict(make_cameras or {})
        videos = bool(self._make_cameras)
        self.directory = start_directory(directory, rig, extra, duration=duration, videos=videos)
        self._log = EventLog(self.directory, "main")
        self._assignment = Assignment(
            rig=self.rig,
            address=self._address,
            tool=tool,
            armed=armed,
            directory=str(self.directory),
            probes=_probes(plan, rig),
            cameras=bool(self._make_cameras),
        )
        plan_text = "" if confirmation is None else confirmation.plan
        self._log.write("session", armed=armed, address=self._address, plan=plan_text)
        self._news = threading.Condition()
        self._sending = threading.Lock()
        self._supervisor: threading.Thread | None = None
        self._checked: Checked | None = None
        self._told = Told((), np.full(6, np.nan))
        self._began: list[Began] = []
        self._done: list[Done] = []
        self._stopped: Stopped | None = None
        self._left = False
        self._closing = False
        self._joints: np.ndarray | None = None
        self._count = 0
        self._children: list[Child] = []
        self._control: Child | None = None
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> "Session":
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is not None:
            self.stop(f"{kind.__name__} in the main process: {error}")
        self.close()

    def start(self) -> None:
        """Start the processes; the pre-flight list is then on its way."""
        atexit.register(self.close)
        if threading.current_thread() is threading.main_thread():
            self._before = {one: signal.signal(one, _end_by_signal) for one in ENDINGS}
        try:
            # what a child imports is nothing that Ctrl-C should show the inside of
            with ignored_interrupts():
                self._start_children()
        except BaseException:
            self.close()
            raise
        self._supervisor = threading.Thread(target=self._supervise, name="supervisor", daemon=True)
        self._supervisor.start()

    def preflight(self) -> list[Check]:
        """The list of what must be true before the arm may move; waits for it.

        Raises:
            SessionStopped: The control process died, or did not answer in time.
        """
        with self._news:
            self._news.wait_for(lambda: self._checked or self._stopped, timeout=PREFLIGHT)
            if self._checked is not None:
                return self._checked.checks
        if self._stopped is None:
            self._end_with(Stopped(f"no pre-flight list within {PREFLIGHT:g} s", "control"))
        raise self._stop_error()

    def pose(self) -> np.ndarray:
        """Where the tool was at the pre-flight: position in the cup's frame, shape (6,).

        Raises:
            RigError: The pre-flight list has failures.
            SessionStopped: The session is over.
        """
        failed = failures(self.preflight())
        checked = self._checked
        if checked is None or checked.pose is None:
            raise RigError(failed, where="pre-flight", fix="mend it and start a new session")
        return self._frame.from_base(checked.pose)

    def follow(self, path: PosePath) -> int:
        """Order a path; it is followed when those before it are done.

        Returns:
            Its number, from 0.

        Raises:
            MotionRejected: It breaks a limit, or the session is a dry run; nothing was ordered.
            RigError: The pre-flight list has failures.
            SessionStopped: The arm was stopped.
        """
        if self._stopped is not None or self._closing:
            raise self._stop_error()
        self.pose()
        if not self._armed:
            raise MotionRejected(
                "the session is a dry run", where="follow", fix="arm it: armed=True"
            )
        assert self._checked is not None
        joints = self._checked.joints if self._joints is None else self._joints
        ended = check_path(path, self.rig, self._assignment.tool, joints=joints)
        self._send(Follow(path))
        self._joints = ended
        self._count += 1
        return self._count - 1

    def wait(self, number: int | None = None, timeout: float | None = None) -> bool:
        """Wait until a path is done, by default the latest; false if that lasts too long.

        Raises:
            SessionStopped: The arm was stopped.
        """
        number = self._count - 1 if number is None else number
        with self._news:
            self._news.wait_for(lambda: len(self._done) > number or self._stopped, timeout)
        if self._stopped is not None:
            raise self._stop_error()
        return len(self._done) > number

    def status(self) -> Status:
        """How it stands; asks the control process for fresh readings, for the next time."""
        if self._stopped is None and not self._closing:
            self._try_to_send(Ask())
        pose = self._frame.from_base(self._told.pose) if self._told.readings else None
        return Status(
            rows={who: self.board.read(who) for who in Who},
            readings=self._told.readings,
            pose=pose,
            began=tuple(self._began),
            done=tuple(self._done),
            stopped=self._stopped,
        )

    def stop(self, reason: str) -> None:
        """Stop the arm for good; what was recorded is kept and marked as aborted."""
        self._try_to_send(Stop(reason))

    def close(self) -> None:
        """End all processes, within about a second where the arm rests; harmless when repeated."""
        with self._news:
            if self._closing:
                return
            self._closing = True
        atexit.unregister(self.close)
        # it takes seconds at most; a second Ctrl-C would leave processes behind
        with ignored_interrupts():
            self._end_all()

    def _end_all(self) -> None:
        if self._control is not None:
            busy = len(self._done) < self._count
            self._try_to_send(Stop("closed during a motion") if busy else Leave())
            self._control.process.join(CONTROL_ENDS[self._assignment.tool])
        others = [child for child in self._children if child is not self._control]
        for child in others:
            tell_to_leave(child)
        for child in end(self._children):
            self._log.write("ended_by_force", process=child.name)
        if self._supervisor is not None:
            self._supervisor.join()
        for child in self._children:
            child.link.close()
        drop_reserve(self.directory)
        self._log.close()
        for number, before in self._before.items():
            signal.signal(number, before)

    def _start_children(self) -> None:
        rig, board, directory = self.rig, self.board, self.directory
        reading, writing = SPAWN.Pipe(duplex=False)
        try:
            self._children.append(
                start("recorder", run_recorder, lambda link: (board, reading, link, directory))
            )
            for view, make in self._make_cameras.items():
                arguments = partial(_camera_arguments, rig, view, make, board, directory)
                self._children.append(start(f"camera {view}", run_camera, arguments))
            self._control = start(
                "control", run_control, lambda link: (self._assignment, board, link, writing)
            )
            self._children.append(self._control)
        finally:
            # the recorder sees the samples' end only if nobody else can write any
            reading.close()
            writing.close()

    def _send(self, order: Order) -> None:
        if self._stopped is not None:
            raise self._stop_error()
        if not self._try_to_send(order):
            raise SessionStopped("the control process is gone")

    def _try_to_send(self, order: Order) -> bool:
        if self._control is None:
            return False
        try:
            with self._sending:
                self._control.link.send(order)
        except OSError:
            return False
        return True

    def _stop_error(self) -> SessionStopped:
        reason = "the session has ended" if self._stopped is None else self._stopped.reason
        return SessionStopped(f"{reason}; look at {self.directory}, then start a new session")

    # -- the supervisor's thread

    def _supervise(self) -> None:
        """Take reports and notice deaths, until all children are gone."""
        assert self._control is not None
        link: Any = self._control.link
        alive = {child.process.sentinel: child for child in self._children}
        while alive:
            sources = [*alive, link] if link is not None else [*alive]
            self._end_if_silent(self._control)
            for ready in wait(sources, timeout=SUPERVISED):
                if ready is link:
                    link = link if self._take_report() else None
                elif isinstance(ready, int):
                    child = alive.pop(ready)
                    child.process.join()
                    if child is self._control and link is not None:
                        while link.poll() and self._take_report():
                            pass
                        link = None
                    self._notice_end(child)

    def _take_report(self) -> bool:
        """Take one report of the control process; false when there will be no more."""
        assert self._control is not None
        try:
            report = self._control.link.recv()
        except (EOFError, OSError):
            return False
        with self._news:
            match report:
                case Checked():
                    self._checked = report
                case Told():
                    self._told = report
                case Began():
                    self._began.append(report)
                case Done():
                    self._done.append(report)
                case Stopped():
                    self._stopped = self._stopped or report
                case Left():
                    self._left = True
            self._news.notify_all()
        return True

    def _end_if_silent(self, control: Child) -> None:
        """A control process that hangs keeps no watchdog quiet, and is of no more use."""
        row = self.board.read(Who.CONTROL)
        over = self._left or not row.beat or not control.process.is_alive()
        if over or row.age(host_time()) <= SILENT:
            return
        control.process.kill()
        self._end_with(Stopped(f"no sign of life of the control process for {SILENT} s", "control"))

    def _notice_end(self, child: Child) -> None:
        expected = self._closing or (child is self._control and (self._left or self._refused))
        if expected or (child is self._control and self._stopped is not None):
            return
        self._end_with(Stopped(ended_how(child), child.name))

    @property
    def _refused(self) -> bool:
        return self._checked is not None and self._checked.pose is None

    def _end_with(self, stopped: Stopped) -> None:
        """Stop the arm and write the reason down, if there is none yet."""
        self._try_to_send(Stop(stopped.reason))
        with self._news:
            if self._stopped is None:
                self._stopped = stopped
                self._log.write("stopped", guard=stopped.guard, reason=stopped.reason)
            self._news.notify_all()


def _camera_arguments(  # noqa: PLR0913  what a camera's process needs
    rig: Rig,
    view: View,
    make: Callable[[], Camera],
    board: Board,
    directory: Path,
    link: Connection,
) -> tuple[Any, ...]:
    return rig, view, make, board, link, directory


def _check_confirmation(address: str, armed: bool, confirmation: Confirmation | None) -> None:
    if not armed:
        return
    if not isinstance(confirmation, Confirmation):
        raise RigError(
            "armed without a confirmation",
            where="Session(armed=True)",
            fix="show the plan and pass confirm(plan, typed, address)",
        )
    if confirmation.address != address:
        raise RigError(
            f"the confirmation is for {confirmation.address}, the controller is at {address}",
            where="Session(confirmation=...)",
            fix="confirm the plan for this controller",
        )
    if confirmation.used:
        raise RigError(
            "the confirmation was for an earlier session",
            where="Session(confirmation=...)",
            fix="show the plan again and pass what confirm returns then",
        )
    confirmation.used = True


def _check_rehearsal(confirmation: Confirmation | None) -> None:
    if confirmation is None or not confirmation.emulated:
        raise RigError(
            "a rehearsal without an emulated arm",
            where="Session(rehearsal=True)",
            fix="pass confirm_emulated(plan, address), or leave rehearsal out",
        )


def _probes(plan: Sequence[PosePath], rig: Rig) -> np.ndarray:
    if not plan:
        return np.empty((0, 6))
    pose = np.concatenate([path.pose for path in plan])
    chosen = np.unique(np.linspace(0, len(pose) - 1, PROBES).astype(int))
    return cup_frame(rig.cup).to_base(pose[chosen])


def _end_by_signal(number: int, _: object) -> None:
    raise SystemExit(128 + number)
