"""The guards: at every tick of the motion loop, is all well enough to go on? (S6)

Pure functions. A guard is a number and its limit; a number that is not finite is beyond it.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ..arm import ArmState
from ..board import Row, Trouble, Who
from ..rig import AxisLimits, Limits

NORMAL, REDUCED = 1 << 0, 1 << 1
RUNNING_MODE, PLAYING = 7, 2
FULL_SPEED = 0.95  # of the speed slider; a slowed arm would fall behind its path
MAX_SPEED_RATIO = 1.5  # times the rig's speed: beyond that the arm does something of its own
RECORDER_AGE = 0.3  # s, since the recorder's last sign of life
MAX_BACKLOG = 0.5  # s, of samples that the recorder has not taken
TURN_ERROR = math.radians(10.0)
TORQUE_LEVER = 0.25  # m: the torque's limit is the force's on such a lever
MAX_CLOCK_DRIFT = 2e-4  # s/s, by which two good clocks may part
YES_LIMIT = 0.5  # limit of what is 0 if it is well and 1 if it is not

SAFETY_MODES = {
    2: "protective stopped",
    3: "recovery",
    4: "safeguard stopped",
    5: "system emergency stopped",
    6: "robot emergency stopped",
    7: "emergency stopped",
    8: "violation",
    9: "fault",
    10: "stopped due to safety",
}
OUTCOME_TROUBLE = {
    Trouble.NONE: "",
    Trouble.WRITE_FAILED: "cannot write",
    Trouble.SOURCE_LOST: "gives no more pictures",
    Trouble.SAME_PICTURE: "gives the same picture again and again",
    Trouble.STOPPED: "has stopped",
    Trouble.BAD_STAMPS: "gives stamps that do not rise",
}
GUARD_MESSAGES = {
    "overrun": "this computer came late by",
    "silence": "the controller has said nothing new for",
    "delay": "what the controller says comes late by",
    "camera xz": "no new picture for",
    "camera yz": "no new picture for",
    "recorder": "no sign of life for",
}
CAMERAS = (Who.CAMERA_XZ, Who.CAMERA_YZ)


class GuardState(NamedTuple):
    """State of the guards from tick to tick.

    Attributes:
        time: Of the latest package, the controller's clock [s].
        fresh: Host time at which it was first seen [s].
        offset: Least difference of the two clocks so far [s], which drifts.
        wrench: At rest, shape (6,).
    """

    time: float
    fresh: float
    offset: float
    wrench: tuple[float, ...]


class Seen(NamedTuple):
    """All that the guards look at in a tick.

    Attributes:
        state: Of the arm.
        watch: Updated with it.
        position: Of the tool's centre in the cup's frame [m].
        error: Distance from the latest set-points [m].
        turn_error: Angle from them [rad].
        rows: The other processes' signs of life.
        late: By which this tick came late [s].
        backlog: Samples that the recorder has not taken [s]; infinite when it has gone.
        now: Host time [s].
    """

    state: ArmState
    watch: GuardState
    position: tuple[float, float, float]
    error: float
    turn_error: float
    rows: Mapping[Who, Row]
    late: float
    backlog: float
    now: float


class Rules(NamedTuple):
    """Limits of the guards: the rig's, and the box of the tool."""

    limits: Limits
    box: AxisLimits


class Reading(NamedTuple):
    """A guard: what it watches, how large that is and may be, both in `unit`."""

    name: str
    value: float
    limit: float
    unit: str

    @property
    def green(self) -> bool:
        """Whether all is well; not so for NaN."""
        return self.value <= self.limit

    @property
    def margin(self) -> float:
        """Rest of the limit, as a share of it; negative when it is passed."""
        return 1.0 - self.value / self.limit


class Trip(NamedTuple):
    """Why the arm must stop: the guard's name, and the reason with its numbers."""

    guard: str
    reason: str


def first_watch(state: ArmState, now: float, wrench: tuple[float, ...]) -> GuardState:
    """Nothing seen but one state."""
    return GuardState(state.time, now, now - state.time, wrench)


def watched(watch: GuardState, state: ArmState, now: float, period: float) -> GuardState:
    """State of the guards after another state of the arm, read at host time `now` [s]."""
    if state.time <= watch.time:
        return watch
    offset = min(watch.offset + MAX_CLOCK_DRIFT * period, now - state.time)
    return watch._replace(time=state.time, fresh=now, offset=offset)


def evaluate(seen: Seen, rules: Rules) -> tuple[Reading, ...]:
    """All guards' readings, causes before their effects."""
    return (*_loop(seen, rules), *_arm(seen, rules), *_others(seen, rules))


def tripped(readings: tuple[Reading, ...], seen: Seen) -> Trip | None:
    """The first guard that is not green."""
    for reading in readings:
        if not reading.green:
            return Trip(reading.name, _reason(reading, seen))
    return None


def _loop(seen: Seen, rules: Rules) -> tuple[Reading, ...]:
    state, watch, limits = seen.state, seen.watch, rules.limits
    return (
        # first: the library stands still itself while it reconnects, which looks like an overrun
        Reading("link", float(not state.connected), YES_LIMIT, ""),
        Reading("overrun", seen.late, limits.overrun, "s"),
        Reading("silence", seen.now - watch.fresh, limits.silence, "s"),
        Reading("delay", watch.fresh - watch.time - watch.offset, limits.silence, "s"),
    )


def _arm(seen: Seen, rules: Rules) -> tuple[Reading, ...]:
    state, limits = seen.state, rules.limits
    change = [a - b for a, b in zip(state.wrench, seen.watch.wrench, strict=True)]
    return (
        Reading("safety", float(not safe(state.safety_bits, limits)), YES_LIMIT, ""),
        Reading("mode", float(state.robot_mode != RUNNING_MODE), YES_LIMIT, ""),
        Reading("program", float(state.runtime_state != PLAYING), YES_LIMIT, ""),
        Reading("force", math.hypot(*change[:3]), limits.force, "N"),
        Reading("torque", math.hypot(*change[3:]), limits.force * TORQUE_LEVER, "Nm"),
        Reading("tracking", seen.error, limits.tracking_error, "m"),
        Reading("turning", seen.turn_error, TURN_ERROR, "rad"),
        Reading("speed", math.hypot(*state.velocity[:3]), MAX_SPEED_RATIO * limits.speed, "m/s"),
        Reading("box", _outside(seen.position, rules.box), 1.0, "of the box"),
        Reading("slider", 1.0 - state.speed_scaling, 1.0 - FULL_SPEED, ""),
    )


def _others(seen: Seen, rules: Rules) -> tuple[Reading, ...]:
    readings = []
    for who, row in seen.rows.items():
        if who in CAMERAS:
            readings.append(Reading(f"{who.label} health", float(row.trouble > 0), YES_LIMIT, ""))
            readings.append(Reading(who.label, row.age(seen.now), rules.limits.frame_age, "s"))
    row = seen.rows[Who.RECORDER]
    return (
        Reading("recorder health", float(row.trouble > 0), YES_LIMIT, ""),
        Reading("recorder pipe", seen.backlog, MAX_BACKLOG, "s"),
        Reading("recorder", row.age(seen.now), RECORDER_AGE, "s"),
        *readings,
    )


def safe(safety_bits: int, limits: Limits) -> bool:
    """Whether the controller's safety status lets the arm move."""
    others = safety_bits & ~(NORMAL | REDUCED)
    if others or not safety_bits:
        return False
    return limits.reduced_mode or not safety_bits & REDUCED


def safety_text(safety_bits: int) -> str:
    """The bits as words."""
    said = [text for bit, text in SAFETY_MODES.items() if safety_bits >> bit & 1]
    if safety_bits & REDUCED:
        said.append("reduced")
    return f"safety_status_bits = {safety_bits} ({', '.join(said) or 'normal'})"


def _outside(position: tuple[float, float, float], box: AxisLimits) -> float:
    """Distance from the box's middle, as a share of the way to its side; largest of the axes."""
    shares = [
        abs(value - 0.5 * (low + high)) / (0.5 * (high - low))
        for value, (low, high) in zip(position, (box.x, box.y, box.z), strict=True)
    ]
    # Python's own `max` may pass over NaN
    return float("nan") if any(map(math.isnan, shares)) else max(shares)


def _reason(reading: Reading, seen: Seen) -> str:
    state, words = seen.state, reading.name.removesuffix(" health")
    rows = {who.label: row for who, row in seen.rows.items()}
    if reading.name.endswith(" health"):
        return f"{words} {OUTCOME_TROUBLE[Trouble(int(rows[words].trouble))]}"
    special = {
        "link": "the connection to the controller is lost; where its arm is going is not known",
        "safety": f"the controller's {safety_text(state.safety_bits)}",
        "mode": f"robot_mode = {state.robot_mode}, not {RUNNING_MODE}",
        "program": f"the controller's program has stopped: runtime_state = {state.runtime_state}",
        "slider": f"the speed is scaled to {100 * state.speed_scaling:.0f} %, "
        f"below {100 * FULL_SPEED:.0f} %",
        "recorder pipe": "the recorder's process is gone"
        if math.isinf(seen.backlog)
        else f"the recorder has not taken {seen.backlog:.2f} s of samples",
    }
    if reading.name in special:
        return special[reading.name]
    measured = f"{reading.value:.4g} {reading.unit}"
    if said := GUARD_MESSAGES.get(reading.name):
        return f"{words}: {said} {measured}, the limit is {reading.limit:.4g}"
    return f"{words}: {measured} is above {reading.limit:.4g}"
