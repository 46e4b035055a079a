"""A session that may move an arm: a person has agreed, or the arm is emulated."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..errors import InputError

if TYPE_CHECKING:
    from ..hardware import Check, EmulatedRig, HiddenLiquid, Rig, Session, Tool
    from ..hardware.motion import PosePath

Ask = Callable[[str], str]
"""Shows a person the plan, and returns what the person typed."""


class Task(NamedTuple):
    """What an arm is to do.

    Attributes:
        rig: What is there.
        tool: In the gripper.
        paths: That will be followed.
        out: Directory of what is recorded; new or empty.
        cameras: Whether the rig's cameras look on.
        about: What a person is told before the motions.
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


EMULATED_VISCOSITY = 1.0  # Pa s, of a liquid of which nothing is said


def hidden_liquid(emulate: "HiddenLiquid | bool") -> "HiddenLiquid | None":
    """What `emulate` stands for: a liquid, the usual one for True, none for False."""
    from ..hardware import HiddenLiquid

    if isinstance(emulate, bool):
        return HiddenLiquid(viscosity=EMULATED_VISCOSITY) if emulate else None
    return emulate


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


@contextmanager
def armed_session(task: Task, by: "Ask | EmulatedRig") -> "Iterator[Session]":
    """Ask a person, unless the arm is emulated; then a session that may move the arm.

    Args:
        task: What will be done.
        by: Shows the plan, and returns the sentence that the plan asks for; or an emulator, which
            nobody is asked about.

    Raises:
        RigError: The person did not agree, or something cannot be used.
    """
    from ..hardware import EmulatedRig, Session, SessionSetup, confirm, webcams

    if isinstance(by, EmulatedRig):
        arm, make_cameras, source = by
        confirmation = None
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
    session = Session(setup)
    with ExitStack() as closed:
        with session:  # which refuses a directory that holds something
            closed.callback(session.discard_unless_moved)
            yield session


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
