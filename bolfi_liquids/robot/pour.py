"""The chosen pour carried out: by the robot, or by an emulated arm."""

import logging
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import InputError
from ..inputs.rigs import rig_of
from ..pouring.result import Pour
from ..run.run import Run, RunOrPath
from .armed_session import (
    Ask,
    Task,
    armed_session,
    check_consent,
)
from .chosen_pour import BAD_FIT, ChosenPour, chosen_pour
from .live_view import SessionView

if TYPE_CHECKING:
    from ..hardware import Check, HiddenLiquid, Rig
    from ..hardware.motion import PosePath

logger = logging.getLogger(__name__)

POURS_FOLDER = "pours"  # directories of what the arm did, in the RUN


class PourMotion(NamedTuple):
    """A pour as a motion.

    Attributes:
        chosen: What is carried out.
        ready: Lip above the place of the pour, in the cup's frame, shape (6,).
        path: From there, down, the turn, back upright and up again.
    """

    chosen: ChosenPour
    ready: np.ndarray
    path: "PosePath"

    @property
    def place(self) -> dict[str, float]:
        """`distance` of the lip from the receiver's axis and `lip_height` above its floor [m]."""
        lip_height = self.chosen.cups.pour.lip_height
        return {"distance": self.chosen.judged.distance, "lip_height": lip_height}


def plan_pour(run: Run, rig: "Rig") -> PourMotion:
    """The motion of the pour that a run has chosen.

    Raises:
        InputError: The run has chosen none, or none that may be carried out, or its receiver stands
            in the cup that is stirred.
        MotionRejected: The motion breaks one of the rig's limits.
    """
    from ..hardware import check_path
    from ..hardware.motion import pour_path, ready_to_pour

    chosen = chosen_pour(run)
    _check_receiver(chosen, rig)
    action, turn = chosen.judged, chosen.cups.pour
    place = {"distance": action.distance, "lip_height": turn.lip_height}
    path = pour_path(
        rig,
        angular_velocity=action.angular_velocity,
        final_angle=turn.final_angle,
        hold=turn.hold,
        **place,
    )
    check_path(path, rig, "pouring")
    return PourMotion(chosen, ready_to_pour(rig, **place), path)


def _check_receiver(chosen: ChosenPour, rig: "Rig") -> None:
    """Only the cups of the pour say how wide its receiver is."""
    from ..hardware.rig import check_receiver

    try:
        check_receiver(rig, chosen.cups.receiver.radius)
    except ValueError as err:
        raise InputError(
            str(err), where="pouring.receiver", fix="move the receiver away, and correct the rig"
        ) from err


def execute_pour(
    run: RunOrPath,
    rig: "Rig | str | Path | None" = None,
    *,
    ask: Ask | None = None,
    emulate: "HiddenLiquid | bool" = False,
    despite_bad_fit: bool = False,
    progress: bool = True,
) -> Path:
    """Carry out the pour that a run has chosen.

    The arm moves only if `ask` returns the sentence that the plan asks for; or it is emulated.

    Args:
        run: A RUN directory, or a calibration, criticism or pour of it.
        rig: Where source and receiver are, or its file; None is the bundled one.
        ask: Shows a person the plan, returns what the person typed.
        emulate: Use an emulated arm instead, as in `record`; a pour shows nothing of the liquid.
        despite_bad_fit: Whether a real arm may carry out what was chosen over a bad fit, by force.
        progress: Whether to show a live view on stderr.

    Returns:
        The directory of what the arm did.

    Raises:
        InputError: The run has chosen no pour over its latest posterior and given pours, its cups
            forbid the pour, another command works in it, or neither or both of `ask` and `emulate`
            are given. For a real arm also: the fit was bad, without `despite_bad_fit`.
        ValueError: Another pour was chosen in the run than the one given.
        MotionRejected: The motion breaks one of the rig's limits.
        SessionStopped: The arm was stopped.
    """
    check_consent(ask, emulate, "execute_pour")
    rig = rig_of(rig)
    with Run.entered(run) as opened:
        plan = plan_pour(opened, rig)
        if isinstance(run, Pour):
            run.check_current(opened)
        if ask is not None:
            plan.chosen.check_fit(despite_bad_fit=despite_bad_fit)
        else:  # nobody is asked, who would read it first
            if plan.chosen.fit_is_bad:
                logger.warning(BAD_FIT)
            logger.info(plan.chosen.expected)
        return _carried_out(plan, rig, ask, emulate, progress)


def _carried_out(
    plan: PourMotion, rig: "Rig", ask: Ask | None, emulate: object, progress: bool
) -> Path:
    """The directory of what an arm did, or an emulated one."""
    from ..hardware import SessionInterrupted, emulated
    from ..hardware.motion import approach_pour

    out = _next_directory(plan.chosen.run.path)
    task = Task(rig, "pouring", [plan.path], out, about=str(plan.chosen))
    emulation = emulated(rig, plan.ready, tool="pouring") if emulate else None
    try:
        with (
            armed_session(task, ask=ask, emulation=emulation) as session,
            SessionView("pouring" if ask else "pouring, emulated", shown=progress) as view,
        ):
            session.follow(approach_pour(rig, session.pose(), **plan.place))
            view.until_done(session, session.follow(plan.path))
    except KeyboardInterrupt:
        left = f"look at {task.out}" if task.out.exists() else "nothing had moved"
        raise SessionInterrupted(f"interrupted, the arm was stopped; {left}") from None
    return task.out


def dry_pour(run: str | Path, rig: "Rig", out: Path) -> "tuple[str, list[Check]]":
    """What the arm would do, and the pre-flight list of a session that cannot move it.

    Raises:
        InputError, MotionRejected: As `plan_pour`.
    """
    from ..hardware import Session, SessionSetup
    from ..hardware.session.confirmation import describe

    plan = plan_pour(Run.open(run), rig)
    setup = SessionSetup(rig, out, tool="pouring", plan=[plan.path])
    with Session(setup) as session:
        text = f"{plan.chosen}\n{describe([plan.path], rig, 'pouring')}"
        return text, session.preflight()


def _next_directory(run: Path) -> Path:
    taken = [int(path.name) for path in (run / POURS_FOLDER).glob("[0-9]*") if path.name.isdigit()]
    return run / POURS_FOLDER / f"{max(taken, default=0) + 1:03d}"
