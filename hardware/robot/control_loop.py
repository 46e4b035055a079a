"""The control process: it alone owns the robot, and may die without taking the recording along.

Its motion loop reads the arm, asks the guards, sends the next set-point, hands on a sample.

It runs on an absolute clock. A set-point is also what keeps the controller's watchdog quiet.
Any fault stops the arm permanently. Nothing resumes; start a new session.
"""

import os
import signal
import sys
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..arm import LOOKAHEAD, WATCHDOG_PERIOD, ArmState, LinkLost, PathFollower
from ..board import Board, Row, Trouble, Who
from ..errors import RigError
from ..motion.poses import cup_frame
from ..motion.pour_paths import upright_again
from ..process import REAL_CLOCK, HostClock, hurry, quieten
from ..recorder.events import EventLog
from ..recorder.samples import Sample
from ..safety.guards import Reading, Rules, Seen, Trip, evaluate, first_watch, tripped, watched
from ..safety.limits import turn_between, workspace
from ..safety.preflight import failures
from .orders import (
    Ask,
    Assignment,
    Began,
    Checked,
    Done,
    Follow,
    Leave,
    Left,
    Stopped,
    Told,
    fingerprint,
    report_to,
)
from .preparation import Prepared, others, prepare
from .queues import Course, Inbox, Leg, Outlet, Trail, Vetting, advanced, queued

SETTLING_PERIODS = 3  # until the controller's program listens again after an order it answers
CHECK_ROOM = 0.5  # of a period, that must be left of it for a slice of a path's check
MOST_WAIT = 0.5  # of a period, for a package that is late
PULL, MOST_PULL = 0.05, 2e-4  # share of the loop's phase that a tick mends, and at most [s]
MAX_LAG = LOOKAHEAD + 0.1  # s, by which the arm may lag behind its set-points
CAUSE_PERIODS = 3  # in which a package tells why the controller ended its program
REST_TIME = 0.6  # s, at most, in which a stopped arm is watched; main waits for longer
RESTING_SPEED = 1e-3  # m/s
RESTING_TICKS = 5
UPRIGHT_ANGLE = float(np.radians(2.0))
# after these the robot is well, and a source of liquid is better turned back than held
MAY_TURN_BACK = ("stop", "main", "order", "camera", "recorder")
IN_DRY_RUN = ("link", "silence")


def _late(since: float) -> str:
    return (
        f"this computer sent nothing for {since:.3f} s, and after {WATCHDOG_PERIOD:g} s the "
        "controller's watchdog ends a program: close what keeps this computer busy"
    )


def refused(reason: str, connected: bool, silent: float) -> Trip:
    """Why a set-point was not taken, `silent` seconds after the one before.

    This process may stand still between a look at the guards and the set-point, too.
    """
    if connected and silent > WATCHDOG_PERIOD:
        return Trip("overrun", f"overrun: {_late(silent)}")
    return Trip("link", reason)


def _nearer(age: float, period: float) -> float:
    """By how much to shift the next tick so that a fresh package waits for it [s].

    Both clocks tick alike, so that a loop which reads just when packages come would miss some and
    see others twice. Read in the middle between two, each is seen once.
    """
    return min(max(PULL * (0.5 * period - age), -MOST_PULL), MOST_PULL)


class Links(NamedTuple):
    """Connections of the loop.

    Attributes:
        board: Where the processes leave signs of life.
        orders: To main: its orders, our reports.
        samples: To the recorder.
        log: Of events.
        signals: Names of those that came; the process's handler appends.
    """

    board: Board
    orders: Connection
    samples: Connection
    log: EventLog
    signals: list[str]


class ControlLoop:
    """The loop's state, and what a tick does with it."""

    def __init__(
        self,
        assignment: Assignment,
        prepared: Prepared,
        links: Links,
        clock: HostClock = REAL_CLOCK,
    ):
        self._clock = clock
        rig = assignment.rig
        self._to = assignment
        self._reader = prepared.reader
        self._arm = prepared.follower
        self._checks = prepared.checks
        self._board = links.board
        self._log = links.log
        self._signals = links.signals
        self._report = partial(report_to, links.orders)
        self._period = 1.0 / rig.robot.rate
        self._frame = cup_frame(rig.cup)
        space = workspace(rig, assignment.tool)
        self._rules = Rules(rig.limits, space.box)
        self._upright = space.orientation
        self._inbox = Inbox(links.orders)
        self._outlet = Outlet(links.samples)
        state = prepared.states[-1]
        self._course = Course(np.array(state.pose))
        self._trail = Trail(self._course.hold, round(MAX_LAG / self._period))
        self._joints = np.array(state.joints)
        self._vetting = Vetting(rig, assignment.tool, self._course.hold, self._joints)
        self._watch = first_watch(state, self._clock.now(), prepared.wrench)
        self._readings: tuple[Reading, ...] = ()
        self._sent = self._clock.now()
        self._trip: Trip | None = None
        self._turning_back: Trip | None = None
        self._leaving = False
        self._still = 0
        self._ticks = 0
        self._worst = 0.0
        self._begun = self._clock.now()

    def run(self) -> int:
        """The loop from its first tick to the arm's rest; the process's exit code."""
        self._begin()
        try:
            self._loop()
        except BaseException as err:
            self._stop(Trip("failed", f"the control process failed: {type(err).__name__}: {err}"))
            self._come_to_rest()
            raise
        self._come_to_rest()
        return 0 if self._trip is None else 1

    def _begin(self) -> None:
        quieten()
        if self._arm is not None:
            self._arm.arm_watchdog()
            self._clock.sleep(SETTLING_PERIODS * self._period)
        self._log.write("ready", armed=self._to.armed, priority=hurry())
        self._inbox.start()
        self._report(Checked(self._checks, self._course.hold, self._joints))
        self._watch = first_watch(self._reader.read(), self._clock.now(), self._watch.wrench)

    def _loop(self) -> None:
        deadline = self._between_packages()
        while not (self._trip or self._leaving and self._at_rest()):
            left = deadline - self._clock.now()
            if left > 0:
                self._clock.sleep(left)
            late = max(self._clock.now() - deadline, 0.0)
            # one that is late would be missed when the next one comes in time
            self._await_package(deadline + MOST_WAIT * self._period, self._watch.time)
            age = self._tick(late)
            # whole periods that were missed are left out: the path is delayed, never hurried
            missed = self._period * int(late / self._period)
            deadline += self._period + missed + _nearer(age, self._period)
            if self._trip is None and deadline - self._clock.now() > CHECK_ROOM * self._period:
                self._vet()

    def _await_package(self, end: float, latest: float) -> None:
        """Wait for one that is newer than the latest, at most to the end."""
        while self._clock.now() < end and self._reader.time() == latest:
            self._clock.sleep(0.05 * self._period)

    def _between_packages(self) -> float:
        """Half a period after the next package comes; one period from now if none does."""
        self._await_package(self._clock.now() + self._period, self._reader.time())
        return self._clock.now() + 0.5 * self._period

    def _at_rest(self) -> bool:
        # a dry run may leave an arm that somebody else moves
        return self._arm is None or self._still >= RESTING_TICKS

    def _tick(self, late: float) -> float:
        """One turn; how old the package was that it read, against the freshest so far [s]."""
        now, state = self._read()
        seen = self._seen(state, late, now)
        self._readings = evaluate(seen, self._rules)
        trip = tripped(self._kept(self._readings), seen) or self._ordered()
        if trip is not None and trip.guard == "program" and now - self._sent > WATCHDOG_PERIOD:
            trip = trip._replace(reason=f"{trip.reason}; {_late(now - self._sent)}")
        if trip is None and self._arm is not None:
            trip = self._go_on(self._arm)
        self._record(state, late, now)
        if trip is not None:
            self._stop(trip)
        return now - self._watch.time - self._watch.offset

    def _kept(self, readings: tuple[Reading, ...]) -> tuple[Reading, ...]:
        """The guards that count now."""
        if self._arm is None:
            return tuple(one for one in readings if one.name in IN_DRY_RUN)
        if self._turning_back:
            return tuple(one for one in readings if not one.name.startswith(MAY_TURN_BACK))
        return readings

    def _go_on(self, arm: PathFollower) -> Trip | None:
        """Send the next set-point."""
        course, turn = advanced(self._course)
        try:
            arm.command(course.hold)
            self._sent = self._clock.now()
        except RigError as err:
            return Trip("order", str(err))
        except LinkLost as err:
            silent = self._clock.now() - self._sent
            return self._cause() or refused(str(err), self._reader.read().connected, silent)
        self._course = course
        self._trail.put(course.hold)
        if self._turning_back is not None:
            # neither its begin nor its end is one of the path that was given up
            return self._turning_back if course.leg is None else None
        if turn.done is not None:
            self._log.write("done", number=turn.done.number, robot_time=self._watch.time)
            self._report(Done(turn.done.number, self._watch.time))
        if turn.began is not None:
            self._tell_begin(turn.began)
        return None

    def _cause(self) -> Trip | None:
        """Why the controller takes no set-points, if it says so within `CAUSE_PERIODS`."""
        end = self._clock.now() + CAUSE_PERIODS * self._period
        while self._clock.now() < end:
            self._clock.sleep(0.25 * self._period)
            now, state = self._read()
            seen = self._seen(state, 0.0, now)
            readings = evaluate(seen, self._rules)
            told = tuple(one for one in readings if one.name in ("safety", "mode"))
            if (trip := tripped(told, seen)) is not None:
                return trip
        return None

    def _tell_begin(self, leg: Leg) -> None:
        self._log.write(
            "began",
            number=leg.number,
            robot_time=self._watch.time,
            duration=leg.path.duration,
            stirring=leg.path.stirring,
            first=leg.base[0].tolist(),
            last=leg.base[-1].tolist(),
            hash=fingerprint(leg.path),
        )
        self._report(Began(leg.number, self._watch.time))

    def _ordered(self) -> Trip | None:
        """Signals, and orders of main."""
        if self._signals:
            return Trip("stop", f"the control process got {self._signals.pop()}")
        while (item := self._inbox.take()) is not None:
            if isinstance(item, Trip):
                # whoever asks again, or goes away, lets the source be turned back to the end;
                # a second signal does not
                if self._turning_back is None:
                    return item
            elif isinstance(item, Follow):
                if self._arm is None:
                    return Trip("order", "an order was refused: the session is a dry run")
                self._vetting.add(item.path)
            elif isinstance(item, Ask):
                self._report(Told(self._readings, np.array(self._reader.read().pose)))
            elif isinstance(item, Leave):
                if self._course.leg or self._course.waiting or self._vetting.busy:
                    return Trip("stop", "told to leave during a motion")
                self._leaving = True
        return None

    def _vet(self) -> None:
        """Check a slice of the paths that were ordered."""
        item = None if self._turning_back else self._vetting.work()
        if isinstance(item, Leg):
            self._course = queued(self._course, item)
        elif isinstance(item, Trip):
            self._stop(item)

    def _stop(self, trip: Trip) -> None:
        """Stop for good; a tilted source is turned back first, where the robot is well."""
        leg = self._course.leg
        if leg is not None and self._can_turn_back(trip, leg):
            back = upright_again(self._to.rig, leg.path, float(leg.path.time[self._course.at]))
            base = self._frame.to_base(back.pose)
            self._course = Course(self._course.hold, waiting=(Leg(leg.number, back, base),))
            self._turning_back = trip
            self._log.write("turning_back", guard=trip.guard, reason=trip.reason)
            return
        if self._turning_back is not None and trip is not self._turning_back:
            self._log.write("not_turned_back", guard=trip.guard, reason=trip.reason)
            trip = self._turning_back._replace(
                reason=f"{self._turning_back.reason}; while turning back: {trip.reason}"
            )
        # first the arm, then the words
        if self._arm is not None:
            self._arm.stop()
        self._trip = trip
        try:
            self._log.write("stopped", guard=trip.guard, reason=trip.reason)
        finally:
            self._report(Stopped(trip.reason, trip.guard))

    def _can_turn_back(self, trip: Trip, leg: Leg) -> bool:
        if self._arm is None or self._to.tool != "pouring" or self._turning_back:
            return False
        # a path that does not begin upright is no way back to it
        begins = turn_between(leg.base[0, 3:], self._upright) <= UPRIGHT_ANGLE
        tilted = turn_between(leg.base[0, 3:], self._course.hold[3:]) > UPRIGHT_ANGLE
        return begins and tilted and trip.guard.startswith(MAY_TURN_BACK)

    def _come_to_rest(self) -> None:
        """Let go of the arm; record it until it rests. No set-point, so no kick, is sent."""
        if self._arm is not None:
            self._arm.stop()
        self._still = 0
        end = self._clock.now() + REST_TIME
        deadline = self._clock.now() + self._period
        while self._clock.now() < end and self._still < RESTING_TICKS:
            self._clock.sleep(max(deadline - self._clock.now(), 0.0))
            deadline += self._period
            now, state = self._read()
            if not state.connected:
                break
            if self._watch.fresh == now:
                self._record(state, 0.0, now)
        self._outlet.flush()
        self._log.write("left", ticks=self._ticks, worst_late=self._worst)
        self._report(Left())

    def _read(self) -> tuple[float, ArmState]:
        now, state = self._clock.now(), self._reader.read()
        # an old state says nothing about rest
        if state.time > self._watch.time:
            self._still = self._still + 1 if state.speed < RESTING_SPEED else 0
        self._watch = watched(self._watch, state, now, self._period)
        return now, state

    def _seen(self, state: ArmState, late: float, now: float) -> Seen:
        pose = np.array(state.pose)
        x, y, z = self._frame.from_base(pose)[:3].tolist()
        error, turn = self._trail.error(pose)
        waiting = self._outlet.waiting * self._period
        return Seen(
            state=state,
            watch=self._watch,
            position=(x, y, z),
            error=error,
            turn_error=turn,
            rows=others(self._to, self._board),
            late=late,
            backlog=float("inf") if self._outlet.gone else waiting,
            now=now,
        )

    def _record(self, state: ArmState, late: float, now: float) -> None:
        leg = self._course.leg
        moving = self._arm is not None and not (self._trip or self._leaving)
        here = self._frame.from_base(np.array(state.pose))
        there = self._frame.from_base(self._course.hold)[:3] if moving else np.full(3, np.nan)
        numbers = (*here.tolist(), *there.tolist(), *state.wrench[:3], state.speed_scaling)
        stirring = int(moving and leg is not None and leg.path.stirring)
        last = (state.safety_bits, state.runtime_state, stirring, late)
        self._outlet.put(Sample._make((self._ticks, state.time, now, *numbers, *last)))
        self._ticks += 1
        self._worst = max(self._worst, late)
        rate = self._ticks / max(now - self._begun, self._period)
        trouble = Trouble.NONE if self._trip is None else Trouble.STOPPED
        share = self._course.at / len(leg.base) if leg is not None else float("nan")
        row = Row(now, trouble, self._ticks, rate, share, self._worst)
        self._board.write(Who.CONTROL, row)


def run_control(
    assignment: Assignment, board: Board, orders: Connection, samples: Connection
) -> None:
    """Look at the arm, and if the pre-flight list is clean and it is armed, follow orders.

    The process ends with this function.

    Args:
        assignment: What to do; without `armed` nothing can move the arm.
        board: Where the processes leave signs of life.
        orders: To main: its orders, our reports; its end stops the arm.
        samples: To the recorder; nobody else may hold this end.
    """
    log = EventLog(Path(assignment.directory), "control")
    links = Links(board, orders, samples, log, [])
    # nothing moves yet, and connecting waits for a controller that may never answer
    _on_signals(lambda *_: os._exit(1))
    code = 1
    try:
        prepared = checked(assignment, links)
        if prepared is not None:
            _on_signals(lambda number, _: links.signals.append(signal.Signals(number).name))
            code = ControlLoop(assignment, prepared, links).run()
    except Exception as err:
        log.write("failed", reason=f"{type(err).__name__}: {err}")
        report_to(orders, Stopped(f"the control process failed: {err}", "failed"))
        raise
    finally:
        sys.stderr.flush()
        # ur_rtde's destructors may wait or crash once a link was lost
        os._exit(code)


def _on_signals(act: Callable[[int, object], None]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, act)


def checked(to: Assignment, links: Links, clock: HostClock = REAL_CLOCK) -> Prepared | None:
    """Go through the pre-flight list and write it down; None unless it is clean."""
    prepared = prepare(to, partial(others, to, links.board), clock)
    checks = prepared.checks
    links.log.write("checked", checks=[list(check) for check in checks], armed=to.armed)
    failed = failures(checks)
    if not failed:
        return prepared
    links.log.write("refused", reason=failed)
    report_to(links.orders, Checked(checks, None, None))
    return None
