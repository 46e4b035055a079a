"""The chosen pour carried out: by the robot, or by the emulator."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..inputs.rigs import rig_of
from ..run.directory import POUR, RUN_TOML, Run, run_path
from .armed_session import (
    Ask,
    Emulation,
    Task,
    armed_session,
    check_one,
)
from .live_view import SessionView

if TYPE_CHECKING:
    from ..hardware import Check, HiddenLiquid, Rig
    from ..hardware.motion import PosePath
    from ..pouring.result import PourSummary

POURS_FOLDER = "pours"  # directories of what the arm did, in the RUN


class PourPlan(NamedTuple):
    """A pour as a motion.

    Attributes:
        angular_velocity: Of the source about its lip [rad/s].
        distance: Horizontally from the lip to the receiver's axis [m].
        lip_height: Above the receiver's floor [m].
        ready: Lip above the place of the pour, in the cup's frame, shape (6,).
        path: From there, down, the turn, back upright and up again.
    """

    angular_velocity: float
    distance: float
    lip_height: float
    ready: np.ndarray
    path: "PosePath"


def plan_pour(run: str | Path, rig: "Rig") -> PourPlan:
    """The motion of the pour that a run has chosen.

    Raises:
        InputError: The run has chosen none.
        MotionRejected: The motion breaks one of the rig's limits.
    """
    from ..hardware import check_path
    from ..hardware.motion import pour_path, ready_to_pour

    chosen, cups = _chosen(Path(run))
    turn = cups["pour"]
    action = {
        "angular_velocity": float(np.radians(chosen.angular_velocity_deg_s)),
        "distance": chosen.distance_cm / 100,
        "lip_height": float(turn["lip_height"]),
    }
    path = pour_path(
        rig,
        final_angle=float(np.radians(turn["final_angle_deg"])),
        hold=float(turn["hold"]),
        **action,
    )
    check_path(path, rig, "pouring")
    ready = ready_to_pour(rig, action["distance"], action["lip_height"])
    return PourPlan(ready=ready, path=path, **action)


def execute_pour(
    run: Run,
    rig: "Rig | str | Path | None" = None,
    *,
    ask: Ask | None = None,
    emulate: "HiddenLiquid | bool" = False,
    progress: bool = True,
) -> Path:
    """Carry out the pour that a run has chosen.

    The arm moves only if `ask` returns the sentence that the plan asks for; or it is emulated.

    Args:
        run: A RUN directory, or a calibration, criticism or pour of it.
        rig: Where source and receiver are, or its file; None is the bundled one.
        ask: Shows a person the plan, returns what the person typed.
        emulate: Use an emulator instead, as in `record`; a pour shows nothing of the liquid.
        progress: Whether to show a live view on stderr.

    Returns:
        The directory of what the arm did.

    Raises:
        InputError: The run has chosen no pour, or neither or both of `ask` and `emulate` are
            given.
        MotionRejected: The motion breaks one of the rig's limits.
        SessionStopped: The arm was stopped.
    """
    from ..hardware import SessionStopped, emulated
    from ..hardware.motion import approach_pour

    check_one(ask, emulate, "execute_pour")
    run, rig = run_path(run), rig_of(rig)
    plan = plan_pour(run, rig)
    task = Task(rig, "pouring", [plan.path], _next_directory(run))
    emulation = None
    if emulate:
        start = emulated(rig, plan.ready, tool="pouring")
        emulation = Emulation(start, source="emulated UR arm")
    try:
        with (
            armed_session(task, ask=ask, emulation=emulation) as session,
            SessionView("pouring" if ask else "pouring, emulated", shown=progress) as view,
        ):
            place = {"distance": plan.distance, "lip_height": plan.lip_height}
            session.follow(approach_pour(rig, session.pose(), **place))
            view.until_done(session, session.follow(plan.path))
    except KeyboardInterrupt:
        raise SessionStopped(f"interrupted, the arm was stopped; look at {task.out}") from None
    return task.out


def dry_pour(run: str | Path, rig: "Rig", out: Path) -> "tuple[str, list[Check]]":
    """What the arm would do, and the pre-flight list of a session that cannot move it."""
    from ..hardware import Session, SessionSetup
    from ..hardware.session.confirmation import describe

    plan = plan_pour(run, rig)
    setup = SessionSetup(rig, out, tool="pouring", plan=[plan.path])
    with Session(setup) as session:
        return describe([plan.path], rig, "pouring"), session.preflight()


def _chosen(run: Path) -> "tuple[PourSummary, dict[str, Any]]":
    """The section "pour" of a run, and the cups that it was chosen for."""
    from ..pouring.result import PourSummary, read_pour

    if not (run / RUN_TOML).exists() and not (run / POUR).exists():
        raise InputError(
            "no run", where=str(run), fix="calibrate first: bolfi-liquids calibrate RECORDING"
        )
    if not (run / POUR).exists():
        raise InputError(
            "no pour was chosen", where=str(run), fix=f"choose one: bolfi-liquids pour {run}"
        )
    tree = read_pour(run)
    return PourSummary.read(run), json.loads(tree.attrs["cups"])


def _next_directory(run: Path) -> Path:
    taken = [int(path.name) for path in (run / POURS_FOLDER).glob("[0-9]*") if path.name.isdigit()]
    return run / POURS_FOLDER / f"{max(taken, default=0) + 1:03d}"
