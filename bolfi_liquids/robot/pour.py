"""The chosen pour: checked, planned, and carried out by the robot, or by an emulated arm."""

import json
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..calibration.summary import FitStatus, bad_fit
from ..errors import InputError
from ..inputs.cups import kept_cups
from ..inputs.rigs import rig_of
from ..models import Cups
from ..pouring.result import Pour
from ..reporting.warnings import Results, warnings_of
from ..run.run import RESULTS, Run, RunOrPath
from ..wording import at_most, spilled
from .armed_session import Ask, Task, armed_session, check_consent, dry_run, told_on_stop

if TYPE_CHECKING:
    from ..hardware import Check, HiddenLiquid, Rig

logger = logging.getLogger(__name__)

POURS_FOLDER = "pours"  # directories of what the arm did, in the RUN
ROUNDING = 1e-9  # relative, of an action that was written and read again
BAD_FIT = "it was chosen over a bad fit: an arm carries it out with --despite-bad-fit only"


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
    from ..hardware import emulated
    from ..hardware.motion import approach_pour, ready_to_pour

    check_consent(ask, emulate, "execute_pour")
    rig = rig_of(rig)
    with Run.entered(run) as opened:
        chosen = chosen_pour(opened)
        task = plan_pour(chosen, rig)
        if isinstance(run, Pour):
            run.check_current(chosen.pour)
        if ask is not None:
            chosen.check_fit(despite_bad_fit=despite_bad_fit)
            by = ask
        else:  # nobody is asked, who would read it first
            if chosen.fit_is_bad:
                logger.warning(BAD_FIT)
            logger.info(chosen.expected)
            by = emulated(rig, ready_to_pour(rig, **chosen.place), tool="pouring")

        def left() -> str:
            return f"look at {task.out}" if task.out.exists() else "nothing had moved"

        with told_on_stop(left), armed_session(task, by, task.tool, progress=progress) as view:
            session, (path,) = view.session, task.paths
            session.follow(approach_pour(rig, session.pose(), **chosen.place))
            view.until_done(session.follow(path))
        return task.out


def dry_pour(run: RunOrPath, rig: "Rig") -> "tuple[str, list[Check]]":
    """Text of the planned pour, and the pre-flight list of a session that cannot move the arm.

    Raises:
        InputError, MotionRejected: As `chosen_pour` and `plan_pour`.
    """
    return dry_run(plan_pour(chosen_pour(Run.open(run)), rig))


@dataclass(frozen=True)
class ChosenPour:
    """Pour to be carried out, with its warnings.

    Attributes:
        pour: As the run has chosen it.
        cups: For which it was chosen.
        fit_is_bad: Whether the fit was, or is, so bad that the pour could only be chosen by force.
        warnings: The report's.
    """

    pour: Pour
    cups: Cups
    fit_is_bad: bool
    warnings: tuple[str, ...]

    def check_fit(self, *, despite_bad_fit: bool) -> None:
        """Refuse a pour that was chosen over a posterior whose fit is bad.

        Args:
            despite_bad_fit: Whether a person has allowed it nevertheless.

        Raises:
            InputError: It is one, and nobody has.
        """
        if self.fit_is_bad and not despite_bad_fit:
            raise InputError(
                "its pour was chosen over a bad fit, and an arm refuses it",
                where=str(self.pour.path),
                fix="correct the recording, calibrate and choose again, or pour nevertheless: "
                "--despite-bad-fit (despite_bad_fit=True)",
            )

    @property
    def place(self) -> dict[str, float]:
        """`distance` of the lip from the receiver's axis and `lip_height` above its floor [m]."""
        return {"distance": self.pour.chosen.distance, "lip_height": self.cups.pour.lip_height}

    def __str__(self) -> str:
        """As a person reads it before the motion, what is wrong first."""
        return "\n".join([*([BAD_FIT] if self.fit_is_bad else []), self.expected])

    @property
    def expected(self) -> str:
        """The action, what it spills, and the report's warnings."""
        chosen = self.pour.chosen
        return "\n".join(
            [
                f"the pour that {self.pour.path} has chosen: "
                f"{np.degrees(chosen.angular_velocity):.1f} deg/s, the lip "
                f"{100 * chosen.distance:.2f} cm from the receiver's axis",
                f"expected to spill {spilled(chosen.expected_spillage)}, "
                f"{at_most(chosen.spillage_q95)} in 95 % of outcomes",
                *(f"warning: {one}" for one in self.warnings),
            ]
        )


def chosen_pour(run: Run) -> ChosenPour:
    """The pour of a run, from pour.nc.

    Raises:
        InputError: The run has chosen none over its latest posterior and given pours, or one that
            lies outside of what its cups allow.
    """
    pour, results = Pour.made(run, run.required("pour")), Results.of(run)
    cups = kept_cups(json.loads(pour.tree.attrs["cups"]))
    ranges = {
        "angular_velocity": (*cups.angular_velocity_range, "rad/s"),
        "distance": (*cups.distance_range, "m"),
    }
    for name, (low, high, unit) in ranges.items():
        value, slack = pour.chosen.action[name], ROUNDING * max(abs(low), abs(high))
        if not low - slack <= value <= high + slack:
            raise InputError(
                f"{name} {value:g} {unit} is outside of {low:g} to {high:g} {unit}, which the "
                "cups allow",
                where=str(run.path / RESULTS["pour"]),
                fix=run.again("pour"),
            )
    was_bad = pour.summary.fit_status is FitStatus.BAD
    is_bad = was_bad or bad_fit(results.latest.summary) is not None
    return ChosenPour(pour, cups, is_bad, tuple(warnings_of(results)))


def plan_pour(chosen: ChosenPour, rig: "Rig") -> Task:
    """The motion of a pour: down, the turn, back upright and up again; recorded in a new directory
    of the run.

    Raises:
        InputError: The pour's receiver stands in the cup that is stirred.
        MotionRejected: The motion breaks one of the rig's limits.
    """
    from ..hardware import check_path
    from ..hardware.motion import pour_path
    from ..hardware.rig_file import receiver_fault

    # only the cups of the pour say how wide its receiver is
    if fault := receiver_fault(rig, chosen.cups.receiver.radius):
        fix = "move the receiver away, and correct the rig"
        raise InputError(fault, where="pouring.receiver", fix=fix)
    turn = chosen.cups.pour
    path = pour_path(
        rig,
        angular_velocity=chosen.pour.chosen.angular_velocity,
        final_angle=turn.final_angle,
        hold=turn.hold,
        **chosen.place,
    )
    check_path(path, rig, "pouring")
    folder = chosen.pour.path / POURS_FOLDER
    taken = [int(one.name) for one in folder.glob("[0-9]*") if one.name.isdigit()]
    out = folder / f"{max(taken, default=0) + 1:03d}"
    return Task(rig, "pouring", [path], out, about=str(chosen))
