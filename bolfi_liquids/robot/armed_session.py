"""A session that may move an arm: a person has agreed, or the arm is emulated."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..errors import InputError

if TYPE_CHECKING:
    from ..hardware import EmulatedRig, HiddenLiquid, Rig, Session, Tool
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


EMULATED_VISCOSITY = 1.0  # Pa s, of a liquid of which nothing is said


def hidden_liquid(emulate: "HiddenLiquid | bool") -> "HiddenLiquid | None":
    """What `emulate` stands for: a liquid, the usual one for True, none for False."""
    from ..hardware import HiddenLiquid

    if isinstance(emulate, bool):
        return HiddenLiquid(viscosity=EMULATED_VISCOSITY) if emulate else None
    return emulate


def check_consent(ask: Ask | None, emulate: object, where: str) -> None:
    """Refuse a motion that nobody is asked about, or that is both real and emulated.

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
def armed_session(
    task: Task, *, ask: Ask | None = None, emulation: "EmulatedRig | None" = None
) -> "Iterator[Session]":
    """Ask a person, unless the arm is emulated; then a session that may move the arm.

    Args:
        task: What will be done.
        ask: Shows the plan; what it returns must be the sentence that the plan asks for.
        emulation: Used instead; nobody is asked.

    Raises:
        InputError: Both are given, or neither.
        RigError: The person did not agree, or something cannot be used.
    """
    from ..hardware import Session, SessionSetup, confirm, webcams
    from ..hardware.session.confirmation import describe

    check_consent(ask, emulation, "armed_session")
    if emulation is not None:
        arm, make_cameras, source = emulation
        confirmation = None
    else:
        assert ask is not None
        text = f"{task.about}\n{describe(task.paths, task.rig, task.tool)}".lstrip()
        arm, make_cameras, source = None, webcams(task.rig), "robot"
        confirmation = confirm(text, ask(text), task.rig.robot.host)
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
    with _discarded_unless_moved(Session(setup)) as session:
        yield session


@contextmanager
def _discarded_unless_moved(session: "Session") -> "Iterator[Session]":
    """The session entered; what a device that failed before any motion has left is removed."""
    with ExitStack() as stack:
        with session:  # which refuses a directory that holds something
            stack.callback(session.discard_unless_moved)
            yield session
