import numpy as np
import pytest
from bolfi_liquids.hardware.arm import ArmState
from bolfi_liquids.hardware.board import Row, Trouble, Who
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.safety.guards import (
    Rules,
    Seen,
    evaluate,
    first_watch,
    tripped,
    watched,
)

LIMITS = bundled_rig().limits
RULES = Rules(LIMITS, LIMITS.stirring)
NOW = 1000.0
WELL = ArmState(
    time=20.0,
    pose=(0.3, -0.7, 0.29, np.pi, 0.0, 0.0),
    velocity=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0),
    wrench=(1.0, 2.0, -3.0, 0.1, 0.0, 0.0),
    joints=(1.8, -1.4, 1.8, -1.9, -1.6, -2.9),
    robot_mode=7,
    runtime_state=2,
    safety_bits=1,
    speed_scaling=1.0,
    speed_slider=1.0,
    connected=True,
)


def seen(state=WELL, rows=None, **changes):
    watch = first_watch(state, NOW, (0.5, 2.0, -3.0, 0.0, 0.0, 0.0))
    all_rows = {
        who: Row(beat=NOW - 0.02) for who in (Who.RECORDER, Who.CAMERA_XZ, Who.CAMERA_YZ)
    } | (rows or {})
    return Seen(
        state=state,
        watch=watch,
        position=(0.01, 0.02, 0.235),
        error=0.002,
        turn_error=0.01,
        rows=all_rows,
        late=0.001,
        backlog=0.04,
        now=NOW + 0.001,
    )._replace(**changes)


def reason(one):
    trip = tripped(evaluate(one, RULES), one)
    return None if trip is None else f"{trip.guard}: {trip.reason}"


def bad(**changes):
    return seen(WELL._replace(**changes))


def row(who, **changes):
    return seen(rows={who: Row(beat=NOW - 0.02)._replace(**changes)})


CASES = {  # what is seen, and the guard that trips
    "overrun": (seen(late=0.051), "overrun"),
    "link": (bad(connected=False), "link"),
    "silence": (seen(now=NOW + 0.051), "silence"),
    "protective stop": (bad(safety_bits=1 << 2 | 1 << 10), "safety"),
    "emergency stop": (bad(safety_bits=1 << 7), "safety"),
    "normal and a fault": (bad(safety_bits=1 | 1 << 9), "safety"),
    "no bits": (bad(safety_bits=0), "safety"),
    "reduced": (bad(safety_bits=2), "safety"),
    "mode": (bad(robot_mode=5), "mode"),
    "program": (bad(runtime_state=1), "program"),
    "paused": (bad(runtime_state=4), "program"),
    "force": (bad(wrench=(0.5, 22.1, -3.0, 0, 0, 0)), "force"),
    "torque": (bad(wrench=(0.5, 2.0, -3.0, 0, 5.2, 0)), "torque"),
    "NaN force": (bad(wrench=(np.nan, 2.0, -3.0, 0, 0, 0)), "force"),
    "tracking": (seen(error=0.0101), "tracking"),
    "turning": (seen(turn_error=0.2), "turning"),
    "speed": (bad(velocity=(0.0, 0.0, -0.24, 0, 0, 0)), "speed"),
    "box": (seen(position=(0.0, -0.051, 0.25)), "box"),
    "below the box": (seen(position=(0.0, 0.0, 0.2)), "box"),
    "NaN place": (seen(position=(0.0, np.nan, 0.25)), "box"),
    "slider": (bad(speed_scaling=0.5), "slider"),
    "camera age": (row(Who.CAMERA_XZ, beat=NOW - 0.16), "camera xz"),
    "camera never": (row(Who.CAMERA_YZ, beat=0.0), "camera yz"),
    "camera lost": (row(Who.CAMERA_XZ, trouble=Trouble.SOURCE_LOST), "camera xz health"),
    "same picture": (row(Who.CAMERA_YZ, trouble=Trouble.SAME_PICTURE), "camera yz health"),
    "bad stamps": (row(Who.CAMERA_XZ, trouble=Trouble.BAD_STAMPS), "camera xz health"),
    "disk": (row(Who.RECORDER, trouble=Trouble.WRITE_FAILED), "recorder health"),
    "recorder": (row(Who.RECORDER, beat=NOW - 0.31), "recorder"),
    "recorder gone": (seen(backlog=float("inf")), "recorder pipe"),
    "recorder slow": (seen(backlog=0.6), "recorder pipe"),
}


def test_nothing_trips_while_all_is_well():
    assert reason(seen()) is None


@pytest.mark.parametrize("name", CASES)
def test_each_guard_trips_alone_and_says_why(name):
    one, guard = CASES[name]
    trip = tripped(evaluate(one, RULES), one)
    assert trip is not None and trip.guard == guard and trip.reason


def test_every_guard_has_a_case():
    names = {reading.name for reading in evaluate(seen(), RULES)}
    # the delay has a test of its own; both cameras' guards are made by one line
    assert names - {guard for _, guard in CASES.values()} == {"delay"}


def test_a_cause_is_named_before_its_effects():
    # a process that stood still for 0.3 s finds its program ended and its cameras' rows old
    stood = seen(WELL._replace(runtime_state=1), late=0.3, now=NOW + 0.3)
    assert (reason(stood) or "").startswith("overrun")
    # the library stands still itself while it reconnects
    dropped = seen(WELL._replace(connected=False), late=0.3)
    assert (reason(dropped) or "").startswith("link")
    stopped = seen(WELL._replace(safety_bits=4, runtime_state=1), error=0.02)
    assert (reason(stopped) or "").startswith("safety")


def test_reduced_mode_is_allowed_by_option_only():
    rules = Rules(LIMITS.model_copy(update={"reduced_mode": True}), LIMITS.stirring)
    one = bad(safety_bits=2)
    assert tripped(evaluate(one, rules), one) is None
    worse = bad(safety_bits=2 | 4)
    assert tripped(evaluate(worse, rules), worse) is not None


def follow_clock(watch, *, seconds, drift=0.0, late=lambda t: 0.0):
    """Packages of a controller whose clock drifts and whose packages come late; worst delay."""
    worst = 0.0
    for k in range(int(seconds * 125)):
        t = k / 125.0
        now = NOW + t
        sent = WELL._replace(time=20.0 + (t - late(t)) * (1.0 + drift))
        watch = watched(watch, sent, now, 1 / 125.0)
        worst = max(worst, watch.fresh - watch.time - watch.offset)
    return worst


def test_late_packages_are_seen_though_the_clock_goes_on():
    watch = first_watch(WELL, NOW, WELL.wrench)
    assert follow_clock(watch, seconds=2.0, late=lambda t: 0.0 if t < 1 else 0.1) > 0.09


def test_clocks_that_drift_are_no_delay():
    for drift in (1e-4, -1e-4):
        watch = first_watch(WELL, NOW, WELL.wrench)
        assert follow_clock(watch, seconds=600.0, drift=drift) < 0.005


def test_a_frozen_clock_is_silence():
    watch = first_watch(WELL, NOW, WELL.wrench)
    for k in range(10):
        watch = watched(watch, WELL, NOW + 0.008 * k, 0.008)
    assert watch.fresh == NOW
