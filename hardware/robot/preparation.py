"""Before the arm may move: connect, go through the pre-flight list, arm the watchdog."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..arm import ArmReader, ArmState, LinkLost, PathFollower
from ..board import Board, Row, Who
from ..errors import RigError
from ..process import REAL_CLOCK, HostClock
from ..safety.guards import CAMERAS, PLAYING
from ..safety.preflight import (
    Check,
    arm_checks,
    disk_check,
    failures,
    mounted_checks,
    payload_check,
    process_checks,
)
from .orders import Assignment

REST_WATCH = 0.3  # s, for which the arm is watched at rest
WAIT_FOR_OTHERS = 15.0  # s, for recorder and cameras to show signs of life


class Prepared(NamedTuple):
    """The pre-flight list, and the arm that it is about.

    Attributes:
        reader: Of the arm; connected, as far as that went.
        follower: The same arm, to be commanded; None unless the session is armed.
        checks: The list.
        states: Of the arm at rest; empty without a connection.
    """

    reader: ArmReader
    follower: PathFollower | None
    checks: list[Check]
    states: list[ArmState]

    @property
    def wrench(self) -> tuple[float, ...]:
        """Mean at rest [N, Nm], shape (6,)."""
        return tuple(np.mean([state.wrench for state in self.states], axis=0).tolist())


def prepare(
    to: Assignment, rows: Callable[[], Mapping[Who, Row]], clock: HostClock = REAL_CLOCK
) -> Prepared:
    """Connect and go through the list, down to the first thing that makes going on unsafe.

    Nothing moves. Control of the arm is taken only if all that a look can tell is well, and never
    in a dry run.

    Args:
        to: The rig and whether the arm may be commanded.
        rows: Gives the other processes' signs of life.
        clock: Of this process.
    """
    rig, checks, states = to.rig, [], []
    follower = to.controller.follower(rig, to.tool) if to.armed else None
    arm = to.controller.reader(rig) if follower is None else follower
    try:
        arm.connect()
        states.extend(_look(arm, 1.0 / rig.robot.rate, clock))
        checks.extend(arm_checks(states, rig))
        checks.extend(_others(to, rows, clock))
        checks.append(disk_check(Path(to.directory)))
        checks.append(payload_check(arm.payload(), rig))
        if follower is None:
            checks.extend(mounted_checks(states[-1], None, rig, to.tool))
        elif not failures(checks):
            states[:] = _take_control(follower, to, checks, clock)
            if failures(checks):
                follower.give_up()
    except (RigError, LinkLost, ImportError, RuntimeError) as err:
        checks.append(Check("controller", False, str(err)))
        if follower is not None:
            follower.give_up()
    return Prepared(arm, follower, checks, states)


def others(to: Assignment, board: Board) -> dict[Who, Row]:
    """Signs of life of the processes on which the arm's motion depends."""
    watched = (Who.RECORDER, *CAMERAS) if to.cameras else (Who.RECORDER,)
    return {who: board.read(who) for who in watched}


def _take_control(
    arm: PathFollower, to: Assignment, checks: list[Check], clock: HostClock
) -> list[ArmState]:
    arm.take_control()
    states = _look(arm, 1.0 / to.rig.robot.rate, clock)
    runtime = states[-1].runtime_state
    checks.append(Check("program", runtime == PLAYING, f"runtime_state = {runtime}"))
    checks.append(payload_check(arm.payload(), to.rig, ours=True))
    checks.extend(mounted_checks(states[-1], arm.tcp(), to.rig, to.tool))
    if len(to.probes):
        allowed = [arm.allows(pose) for pose in to.probes]
        text = f"{sum(allowed)} of {len(allowed)} poses of the plan are within them"
        checks.append(Check("controller's limits", all(allowed), text))
    return states


def _look(arm: ArmReader, period: float, clock: HostClock) -> list[ArmState]:
    states = []
    end = clock.now() + REST_WATCH
    while clock.now() < end:
        states.append(arm.read())
        clock.sleep(period)
    return states


def _others(to: Assignment, rows: Callable[[], Mapping[Who, Row]], clock: HostClock) -> list[Check]:
    """Waits for the others, since all start at once."""
    end = clock.now() + WAIT_FOR_OTHERS
    while True:
        checks = process_checks(rows(), to.rig, clock.now())
        if not failures(checks) or clock.now() > end:
            return checks
        clock.sleep(0.02)
