"""Recording a stir: the arm, the cameras, and the recording that they leave."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..errors import Argument, InputError
from ..files import disk_errno, given_path
from ..inputs.open import check_recording, read_recording
from ..inputs.recording import Recording
from ..inputs.rigs import rig_of
from ..wording import command
from .armed_session import Ask, Task, armed_session, check_consent, dry_run, hidden_liquid
from .hidden_stir import with_stir
from .live_view import SessionView
from .stir import StirPlan, follow_plan, plan_stir, stir_task

if TYPE_CHECKING:
    from ..hardware import Check, HiddenLiquid, Rig, Session
    from ..hardware.motion import PosePath


def record(
    rig: "Rig | str | Path | None" = None,
    *,
    out: str | Path,
    ask: Ask | None = None,
    emulate: "HiddenLiquid | bool" = False,
    cycles: int | None = None,
    progress: bool = True,
) -> Recording:
    """Stir, and record the stir.

    The arm moves only if `ask` returns the sentence that the plan asks for; or there is no arm
    and all of it is emulated. Whatever stops it, what was recorded until then is kept in `out`.

    Args:
        rig: What is there, or its file; None is the bundled one.
        out: Directory of the recording; new or empty.
        ask: Shows a person the plan, returns what the person typed.
        emulate: Use an emulated arm and rendered cameras, which look at this liquid; True takes
            one of 1 Pa s.
        cycles: How often the pattern is repeated; None as in the rig's file.
        progress: Whether to show a live view on stderr, if that is a terminal.

    Returns:
        The recording, of `out`/recording.nc.

    Raises:
        InputError: Neither `ask` nor `emulate` is given, or both; or the stir of the emulated
            liquid cannot be simulated.
        RigError: The rig, the directory or a device cannot be used, or the person did not agree.
        MotionRejected: The plan breaks one of the rig's limits.
        SessionStopped: The arm was stopped; the message says why.
    """
    stir = prepare_stir(rig, out, ask, emulate, cycles)
    title = "stirring" if ask else "stirring, emulated"
    with stir_session(stir, title, progress) as (session, view):
        view.motions = 1 + len(stir.task.paths)

        def wait(number: int, _: "PosePath") -> bool:
            view.until_done(session, number)
            return False

        follow_plan(session, stir.plan, wait)
    return finished(stir.task.out)


class PlannedStir(NamedTuple):
    """A stir that is planned and checked, and may be carried out.

    Attributes:
        plan: What the arm will do.
        task: The same for a session.
        by: Shows a person the plan; or the liquid of an emulated arm with rendered cameras, which
            nobody is asked about.
    """

    plan: StirPlan
    task: Task
    by: "Ask | HiddenLiquid"


def prepare_stir(
    rig: "Rig | str | Path | None",
    out: str | Path,
    ask: Ask | None,
    emulate: "HiddenLiquid | bool",
    cycles: int | None,
) -> PlannedStir:
    """Check and plan a stir; the arguments and errors of `record`."""
    check_consent(ask, emulate, "record")
    opened, hidden = rig_of(rig), hidden_liquid(emulate)
    plan, directory = plan_stir(opened, cycles), given_path(out, Argument("out"))
    check_new(directory)
    by = ask if hidden is None else with_stir(opened, plan, hidden)
    assert by is not None
    return PlannedStir(plan, stir_task(opened, plan, directory), by)


@contextmanager
def stir_session(
    stir: PlannedStir, title: str, progress: bool
) -> "Iterator[tuple[Session, SessionView]]":
    """A session that may move the arm, and its view; what it records is kept whatever stops it.

    Raises:
        InputError: A camera is a file.
        RigError: The person did not agree, or something cannot be used.
        SessionStopped: The arm was stopped; the message says what was recorded.
    """
    from ..hardware import HiddenLiquid, emulated
    from ..hardware.motion import above_cup

    by, rig, out = stir.by, stir.task.rig, stir.task.out
    if isinstance(by, HiddenLiquid):
        by = emulated(rig, above_cup(rig), liquid=by, truth=out)
    else:
        _check_devices(rig)
    with (
        save_on_stop(out),
        armed_session(stir.task, by) as session,
        SessionView(title, shown=progress) as view,
    ):
        yield session, view


def _check_devices(rig: "Rig") -> None:
    for camera in rig.cameras:
        if not camera.is_device:
            raise InputError(
                f"source = {camera.source!r} is a file",
                where=f"rig.toml: camera {camera.view}",
                fix="a real arm moves only while real cameras look on: name a device",
            )


def dry_stir(rig: "Rig", cycles: int | None, out: Path) -> "tuple[str, list[Check]]":
    """The plan of a stir, and the pre-flight list of a session that cannot move the arm.

    Raises:
        InputError, MotionRejected: As `plan_stir`.
        RigError: `out` holds something, or cannot be used.
    """
    check_new(out)
    return dry_run(stir_task(rig, plan_stir(rig, cycles), out))


def check_new(directory: Path) -> None:
    """Refuse a directory that holds something, before anything that takes long begins.

    Raises:
        RigError: It holds something.
    """
    from ..hardware.recorder.directory import check_empty

    if directory.is_dir():
        check_empty(directory)


def finished(directory: Path) -> Recording:
    """The recording of a session that has ended.

    Raises:
        SessionStopped: It was aborted so early that its recording cannot be used.
        InputError: It was not, and cannot be used nevertheless.
    """
    from ..hardware import SessionStopped, finalise

    recording = read_recording(finalise(directory))
    try:
        check_recording(recording)
    except InputError as err:
        if recording.attrs.get("status") != "aborted":
            raise
        reason = recording.attrs.get("reason") or "no reason given"
        raise SessionStopped(f"{recording.path}: aborted: {reason}; {err}") from err
    return recording


@contextmanager
def save_on_stop(directory: Path) -> Iterator[None]:
    """Save the frames taken before a stop as a recording.

    Raises:
        SessionStopped: It was stopped, or interrupted; the message says what was recorded.
    """
    from ..hardware import SessionInterrupted, SessionStopped

    try:
        yield
    except SessionStopped as err:
        raise SessionStopped(f"{err}; {_left(directory)}") from None
    except KeyboardInterrupt:
        raise SessionInterrupted(f"interrupted, the arm was stopped; {_left(directory)}") from None


def _left(directory: Path) -> str:
    from ..hardware import RigError, finalise

    if not directory.exists():  # `armed_session` has removed it
        return "nothing had moved, and nothing was recorded"
    try:
        return f"what was recorded until then is in {finalise(directory)}"
    except OSError as err:
        cure = "make room" if disk_errno(err) is not None else "make it writable"
        again = command("trim", directory, "--out", "FILE")
        return f"{directory}: {err.strerror or err}: {cure}, then make its recording by: {again}"
    except (RigError, ValueError) as err:
        return f"no recording can be made of it ({err})"
