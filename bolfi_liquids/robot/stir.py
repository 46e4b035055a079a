"""The stir of a rig: planned within its limits, and followed until it is enough."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import Argument, InputError
from ..inputs.start import REST_TIME, SETTLING_TIME

if TYPE_CHECKING:
    from ..hardware import Rig, Session
    from ..hardware.motion import PosePath

MIN_REST = REST_TIME + SETTLING_TIME  # s, in which `check_start` sees a recording rest
PATHS_AHEAD = 2  # paths ordered beyond the one that runs, so that the arm need not wait


class StirPlan(NamedTuple):
    """Paths of the arm from above the cup on, all of them within the rig's limits.

    Attributes:
        insert: Down into the liquid.
        strokes: Of the stir, each starting where the one before ends.
        retract: Out of the cup.
    """

    insert: "PosePath"
    strokes: tuple["PosePath", ...]
    retract: "PosePath"

    @property
    def paths(self) -> tuple["PosePath", ...]:
        """All of it, in order."""
        return (self.insert, *self.strokes, self.retract)


def plan_stir(rig: "Rig", cycles: int | None = None) -> StirPlan:
    """Plan the stir of a rig's file.

    Args:
        rig: What is there.
        cycles: How often the pattern is repeated; None as in the rig's file.

    Raises:
        InputError: `cycles` is below 1 or too large, or a recording would not begin at rest.
        MotionRejected: The plan breaks one of the rig's limits.
    """
    from ..hardware import check_path
    from ..hardware.motion import insert, retract, strokes
    from ..hardware.rig import MAX_CYCLES

    count = rig.stirring.cycles if cycles is None else cycles
    if not 1 <= count <= MAX_CYCLES:
        fix = f"give a whole number from 1 to {MAX_CYCLES}"
        raise InputError(f"{count}", where=Argument("cycles"), fix=fix)
    if rig.stirring.rest < MIN_REST:
        raise InputError(
            f"{rig.stirring.rest:g} s",
            where="rig: stirring.rest",
            fix=f"give {MIN_REST:g} s or more: a recording must begin at rest",
        )
    stir = tuple(strokes(rig, count))
    plan = StirPlan(insert(rig), stir, retract(rig, stir[-1].pose[-1, :3]))
    joints = None
    for path in plan.paths:
        joints = check_path(path, rig, "stirring", joints=joints)
    return plan


def follow_plan(
    session: "Session", plan: StirPlan, wait: Callable[[int, "PosePath"], bool]
) -> None:
    """From where the arm is: to the cup, strokes until it is enough, and out again.

    Args:
        session: Which may move the arm.
        plan: What it will do.
        wait: Waits for the end of a path, by its number; whether no further stroke is wanted.

    Raises:
        RigError: The pre-flight list has failures.
        SessionStopped: The arm was stopped.
    """
    from ..hardware.motion import PosePath, approach, retract

    ordered, enough = list[tuple[int, PosePath]](), False

    def follow(path: PosePath) -> None:
        nonlocal enough
        ordered.append((session.follow(path), path))
        # all at once would be checked at once, which takes the cameras' time
        if len(ordered) > PATHS_AHEAD:
            enough = wait(*ordered[-1 - PATHS_AHEAD])

    rig, out = session.rig, plan.retract
    follow(approach(rig, session.pose()))
    follow(plan.insert)
    for number, stroke in enumerate(plan.strokes, start=1):
        follow(stroke)
        # by number: all strokes of a circle are one path
        if enough and number < len(plan.strokes):
            # the rest at the end, as the plan's last stroke has it
            times = np.arange(0.0, rig.stirring.rest, 1.0 / rig.robot.rate)
            still = np.tile(stroke.pose[-1], (len(times), 1))
            follow(PosePath(times, still, stirring=True))
            out = retract(rig, stroke.pose[-1, :3])
            break
    follow(out)
    for last in ordered[-PATHS_AHEAD:]:
        wait(*last)
