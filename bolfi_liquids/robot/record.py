"""Recording a stir: the arm, the cameras, and the recording that they leave."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ..files import given_path
from ..inputs.open import open_recording
from ..inputs.recording import Recording
from ..inputs.rigs import rig_of
from .armed_session import Ask, check_one, hidden_liquid
from .live_view import SessionView
from .stir import follow_plan, plan_stir, stir_session

if TYPE_CHECKING:
    from ..hardware import HiddenLiquid, Rig


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
        emulate: Use an emulator and rendered cameras, which look at this liquid; True takes one
            of 1 Pa s.
        cycles: How often the pattern is repeated; None as in the rig's file.
        progress: Whether to show a live view on stderr, if that is a terminal.

    Returns:
        The recording, of `out`/recording.nc.

    Raises:
        InputError: Neither `ask` nor `emulate` is given, or both.
        RigError: The rig, the directory or a device cannot be used, or the person did not agree.
        MotionRejected: The plan breaks one of the rig's limits.
        SessionStopped: The arm was stopped; the message says why.
    """
    from ..hardware import finalise

    check_one(ask, emulate, "record")
    opened, hidden = rig_of(rig), hidden_liquid(emulate)
    plan, out = plan_stir(opened, cycles), given_path(out, "--out")
    title = "stirring" if hidden is None else "stirring, emulated"
    with (
        kept(out),
        stir_session(opened, plan, out, ask=ask, emulate=hidden) as session,
        SessionView(title, shown=progress) as view,
    ):
        follow_plan(session, plan, view)
    return open_recording(finalise(out))


@contextmanager
def kept(directory: Path) -> Iterator[None]:
    """What is left of a session that is stopped within becomes a recording.

    Raises:
        SessionStopped: It was stopped, or interrupted; the message says what is left.
    """
    from ..hardware import SessionStopped

    try:
        yield
    except SessionStopped as err:
        raise SessionStopped(f"{err}; {_left(directory)}") from None
    except KeyboardInterrupt:
        raise SessionStopped(f"interrupted, the arm was stopped; {_left(directory)}") from None


def _left(directory: Path) -> str:
    from ..hardware import RigError, finalise

    try:
        return f"what was recorded until then is in {finalise(directory)}"
    except (RigError, OSError, ValueError) as err:
        return f"no recording can be made of it ({err})"
