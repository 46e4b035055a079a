"""A session: the processes around one recording, started, supervised and ended by main."""

import atexit
import signal
import threading
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from ..board import Board, Who, check_can_start
from ..errors import MotionRejected, RigError
from ..motion.poses import cup_frame
from ..motion.stir_paths import PosePath
from ..process import ignored_interrupts
from ..recorder.directory import discard_directory, start_directory
from ..recorder.events import EventLog, detailed, drop_reserve, read_events
from ..robot.orders import Ask, Follow, Leave, Stop, Stopped
from ..safety.limits import check_path
from ..safety.preflight import Check, failures
from .processes import Processes, Progress, SessionStopped, Status
from .setup import SessionSetup

END_SIGNALS = (signal.SIGTERM, signal.SIGHUP)  # Ctrl-C raises KeyboardInterrupt already
PREFLIGHT_TIMEOUT = 30.0  # s, until the pre-flight list must be there
# s, until the arm must be at rest and its process gone; a source is turned back upright first
CONTROL_ENDS = {"stirring": 0.7, "pouring": 5.0}


class Session:
    """One recording; a context manager. A dry run unless its setup is armed.

    A dry run looks at the arm and records where it is; it opens no connection that could move it.
    Where other libraries of robots have another word:

        connect             start(), or entering the `with` block
        is_connected        preflight() has no failures; status() is neither stopped nor closed
        get_observation     status()
        send_action         follow(path), a whole path; wait() until it is done
        stop                stop(reason), for good
        disconnect          close(), or leaving the `with` block

    Attributes:
        setup: What the session is for.
        rig: Its limits are the guards'; wider than the setup's in a rehearsal.
        directory: Of the recording.
        board: Signs of life of the processes.

    Args:
        setup: What the session is for; nothing is written or started before `start`.
    """

    def __init__(self, setup: SessionSetup):
        check_can_start()
        self.setup = setup
        self.rig = setup.guarded_rig
        self.directory = Path(setup.directory)
        self.board = Board()
        self._frame = cup_frame(self.rig.cup)
        self._progress = Progress()
        self._log: EventLog | None = None
        self._processes: Processes | None = None
        self._handlers: dict[signal.Signals, Any] = {}  # of signals, from before the session

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
        """Make the directory and start the processes; the pre-flight list is then on its way.

        Raises:
            SessionStopped: The session was started or closed before.
            RigError: The directory cannot be used, or the confirmation was used before.
        """
        if self._log is not None or self._progress.closing:
            raise SessionStopped("a session starts once; make a new one for another recording")
        self._log = self._begin_recording()
        self._processes = Processes(self.board, self._log, self._progress)
        atexit.register(self.close)
        if threading.current_thread() is threading.main_thread():
            self._handlers = {one: signal.signal(one, _end_by_signal) for one in END_SIGNALS}
        try:
            # what a child imports is nothing that Ctrl-C should show the inside of
            with ignored_interrupts():
                self._processes.start(self.setup.assignment(), self.setup.make_cameras)
        except BaseException:
            self.close()
            self.discard_unless_moved()
            raise
        self._processes.supervise()

    def _begin_recording(self) -> EventLog:
        setup = self.setup
        setup.take_confirmation()
        extra = {"source": setup.source, "tool": setup.tool, "rehearsal": setup.rehearsal}
        videos, lasts = bool(setup.make_cameras), sum(path.duration for path in setup.plan)
        # the rig itself, not the guards', whose limits a rehearsal widens
        start_directory(self.directory, setup.rig, extra, duration=lasts, videos=videos)
        log = EventLog(self.directory, "main")
        plan = "" if setup.confirmation is None else setup.confirmation.plan
        log.write("session", armed=setup.armed, address=setup.controller.address, plan=plan)
        return log

    def preflight(self) -> list[Check]:
        """The list of what must be true before the arm may move; waits for it.

        Raises:
            SessionStopped: The session was not started, or the control process died or did not
                answer in time.
        """
        progress = self._progress
        if self._processes is None:
            raise SessionStopped("the session has not been started: enter it by `with`")
        progress.wait_for(lambda: progress.checked is not None, PREFLIGHT_TIMEOUT)
        if progress.checked is not None:
            return progress.checked.checks
        if progress.stopped is None:
            reason = f"no pre-flight list within {PREFLIGHT_TIMEOUT:g} s"
            self._processes.stop(Stopped(reason, "control"))
        raise self._stop_error()

    def pose(self) -> np.ndarray:
        """Pose of the tool at the pre-flight: position in the cup's frame, shape (6,).

        Raises:
            RigError: The pre-flight list has failures.
            SessionStopped: The session is over.
        """
        failed = failures(self.preflight())
        checked = self._progress.checked
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
        progress = self._progress
        if progress.stopped is not None or progress.closing:
            raise self._stop_error()
        self.pose()
        if not self.setup.armed:
            raise MotionRejected(
                "the session is a dry run", where="follow", fix="arm it: armed=True"
            )
        assert progress.checked is not None
        joints = progress.checked.joints if progress.joints is None else progress.joints
        ended = check_path(path, self.rig, self.setup.tool, joints=joints)
        if progress.stopped is not None:
            raise self._stop_error()
        if self._processes is None or not self._processes.send(Follow(path)):
            raise SessionStopped("the control process is gone")
        progress.joints = ended
        progress.ordered += 1
        return progress.ordered - 1

    def wait(self, number: int | None = None, timeout: float | None = None) -> bool:
        """Wait until a path is done, by default the latest; false if that lasts too long.

        Raises:
            SessionStopped: The arm was stopped.
        """
        progress = self._progress
        last = progress.ordered - 1 if number is None else number
        progress.wait_for(lambda: len(progress.done) > last, timeout)
        if progress.stopped is not None:
            raise self._stop_error()
        return len(progress.done) > last

    def status(self) -> Status:
        """State of the session; asks the control process for fresh readings, for the next time."""
        progress = self._progress
        if self._processes is not None and progress.stopped is None and not progress.closing:
            self._processes.send(Ask())
        told = progress.told
        return Status(
            rows={who: self.board.read(who) for who in Who},
            readings=told.readings,
            pose=self._frame.from_base(told.pose) if told.readings else None,
            began=tuple(progress.began),
            done=tuple(progress.done),
            stopped=progress.stopped,
            closed=progress.closing,
        )

    def stop(self, reason: str) -> None:
        """Stop the arm for good; what was recorded is kept and marked as aborted."""
        if self._processes is not None:
            self._processes.send(Stop(reason))

    def close(self) -> None:
        """End all processes, within about a second where the arm rests; harmless when repeated."""
        with self._progress.writing:
            if self._progress.closing:
                return
            self._progress.closing = True
        atexit.unregister(self.close)
        # it takes seconds at most; a second Ctrl-C would leave processes behind
        with ignored_interrupts():
            self._end_all()

    def discard_unless_moved(self) -> None:
        """Remove the directory of a session that is closed and in which no motion was ordered.

        What failed before the first motion must not be in the way of the next try. A dry run, which
        never moves, calls this only if what it recorded is of no use.
        """
        if self._progress.closing and self._log is not None and not self._progress.ordered:
            discard_directory(self.directory)

    def _end_all(self) -> None:
        if self._processes is not None:
            last = Stop("closed during a motion") if self._progress.busy else Leave()
            self._processes.end(last, CONTROL_ENDS[self.setup.tool])
        if self._log is not None:
            drop_reserve(self.directory)
            self._log.close()
        for number, before in self._handlers.items():
            signal.signal(number, before)

    def _stop_error(self) -> SessionStopped:
        stopped = self._progress.stopped
        reason = "the session has ended"
        if stopped is not None:
            reason = detailed(stopped.reason, read_events(self.directory))
        look = f"look at {self.directory}, then " if self._progress.began else ""
        return SessionStopped(f"{reason}; {look}start a new session")


def _end_by_signal(number: int, _: object) -> None:
    raise SystemExit(128 + number)
