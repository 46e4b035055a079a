"""A session that may move an arm: a person has agreed, or the arm is emulated."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rich.console import Console, Group
from rich.live import Live

from ..errors import InputError

if TYPE_CHECKING:
    from ..hardware import Check, EmulatedRig, Rig, Session, Tool
    from ..hardware.motion import PosePath

Ask = Callable[[str], str]
"""Shows a person the plan, and returns what the person typed."""

REFRESH_RATE = 5.0  # per second, of the live view


class Task(NamedTuple):
    """Motion of an arm, and where it is recorded.

    Attributes:
        rig: What is there.
        tool: In the gripper.
        paths: That will be followed.
        out: Directory of what is recorded; new or empty.
        cameras: Whether the rig's cameras look on.
        about: What a person reads before the motions.
    """

    rig: "Rig"
    tool: "Tool"
    paths: "Sequence[PosePath]"
    out: Path
    cameras: bool = False
    about: str = ""

    def describe(self) -> str:
        """The plan as a person reads it."""
        from ..hardware.session.setup import describe

        return f"{self.about}\n{describe(self.paths, self.rig, self.tool)}".lstrip()


def check_consent(ask: Ask | None, emulate: object, where: str) -> None:
    """Require either a confirmation or the emulator, not both.

    Raises:
        InputError: `ask` and `emulate` are both given, or neither is.
    """
    if (ask is None) == (not emulate):
        raise InputError(
            "neither or both of ask and emulate",
            where=where,
            fix="give ask= for a real arm, or emulate= for a dry run",
        )


@dataclass
class SessionView:
    """A session and its live view in a terminal.

    Attributes:
        session: May move the arm.
        title: What is going on.
        motions: Of the task, the way to its beginning included.
        console: Where it is shown.
        live: What is drawn again and again; None where stderr is no terminal.
        note: Line beside the view.
    """

    session: "Session"
    title: str
    motions: int
    console: Console
    live: Live | None
    note: str = ""

    def until_done(self, number: int) -> None:
        """Wait until a path is done.

        Raises:
            SessionStopped: The arm was stopped.
        """
        while not self.session.wait(number, timeout=1.0 / REFRESH_RATE):
            self.show()
        self.show()

    def say(self, note: str) -> None:
        """Keep a line beside the view; where there is no view, print it once."""
        if self.live is None and note != self.note:
            self.console.print(note, highlight=False, soft_wrap=True)
        self.note = note

    def show(self) -> None:
        """Draw the session as it is now."""
        if self.live is None:
            return
        from ..hardware.board import host_time
        from ..hardware.session.live import live_table

        status = self.session.status()
        motion = min(len(status.done) + 1, self.motions)
        title = f"{self.title}, motion {motion} of {self.motions}"
        self.live.update(Group(live_table(title, status, host_time()), self.note), refresh=True)


@contextmanager
def armed_session(
    task: Task, by: "Ask | EmulatedRig", title: str, *, progress: bool = False
) -> Iterator[SessionView]:
    """Ask a person, unless the arm is emulated; then a session that may move the arm.

    Args:
        task: What will be done.
        by: Shows the plan, and returns the sentence that the plan asks for; or an emulator, which
            nobody is asked about.
        title: Of the view.
        progress: Whether to show a live view, if stderr is a terminal.

    Raises:
        RigError: The person did not agree, or something cannot be used.
    """
    from ..hardware import EmulatedRig, Session, SessionSetup, confirm, webcams

    if isinstance(by, EmulatedRig):
        arm, make_cameras, source = by
        confirmation, title = None, f"{title}, emulated"
    else:
        arm, make_cameras, source = None, webcams(task.rig), "robot"
        text = task.describe()
        confirmation = confirm(text, by(text), task.rig.robot.host)
    setup = SessionSetup(
        task.rig,
        task.out,
        arm,
        make_cameras if task.cameras else {},
        tool=task.tool,
        armed=True,
        confirmation=confirmation,
        plan=task.paths,
        source=source,
    )
    console = Console(stderr=True, quiet=not progress)
    shown = progress and console.is_terminal
    live = Live(console=console, auto_refresh=False) if shown else None
    session = Session(setup)
    with ExitStack() as closed:
        with session:  # which refuses a directory that holds something
            closed.callback(session.discard_unless_moved)
            with live or nullcontext():
                yield SessionView(session, title, 1 + len(task.paths), console, live)


@contextmanager
def told_on_stop(left: Callable[[], str]) -> Iterator[None]:
    """Say what a session has left where it is stopped within.

    Args:
        left: What there is to find, or that nothing had moved.

    Raises:
        SessionStopped: It was stopped, or interrupted; the message ends with what is left.
    """
    from ..hardware import SessionInterrupted, SessionStopped

    try:
        yield
    except SessionStopped as err:
        raise SessionStopped(f"{err}; {left()}") from None
    except KeyboardInterrupt:
        raise SessionInterrupted(f"interrupted, the arm was stopped; {left()}") from None


def dry_run(task: Task) -> "tuple[str, list[Check]]":
    """The plan, and the pre-flight list of a session that cannot move the arm.

    What it records goes to a temporary directory, on the disk that `task.out` would be on.

    Raises:
        RigError: The directory cannot be used.
    """
    from ..hardware import Session, SessionSetup, webcams

    near = next(one for one in (task.out, *task.out.absolute().parents) if one.is_dir())
    cameras = webcams(task.rig) if task.cameras else {}
    with tempfile.TemporaryDirectory(dir=near) as directory:
        setup = SessionSetup(
            task.rig, Path(directory), make_cameras=cameras, tool=task.tool, plan=task.paths
        )
        with Session(setup) as session:
            return task.describe(), session.preflight()
