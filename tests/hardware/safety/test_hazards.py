"""Each hazard of the client library and each safety requirement: its answer, and who tests it.

The numbers are those of the project's notes on ur_rtde 1.6.5 (hazards 1 to 14) and of its safety
requirements (S1 to S11).
"""

from pathlib import Path
from typing import NamedTuple

import pytest


class Answer(NamedTuple):
    """A hazard in short, the answer, and tests as "file: words of its name"."""

    hazard: str
    answer: str
    tests: tuple[str, ...]


ANSWERS = {
    "1": Answer(
        "constructors hold Python's lock",
        "the arm has a process of its own; main ends a control process that hangs",
        (
            "session/session: control_process_that_hangs_is_ended",
            "session/session: leaves_nothing_behind",
        ),
    ),
    "2": Answer(
        "getters repeat the last value, servoL says True on a dead link",
        "guards link, silence and delay; a lost link stays lost in the driver",
        (
            "robot/ur_driver: lost_link_is_seen_at_once_and_stays_lost",
            "safety/guards: frozen_clock_is_silence",
            "safety/guards: late_packages_are_seen",
        ),
    ),
    "3": Answer(
        "the control interface reconnects by itself, and crashes",
        "nothing is sent after a loss, the interface that moves the arm uploads no script, and the "
        "process ends without the library's clean-up",
        (
            "robot/ur_driver: nothing_is_sent_though_the_library_reconnects",
            "safety/faults: fault_during_motion",
        ),
    ),
    "4": Answer(
        "without a watchdog the arm goes on when the client dies",
        "set-points instead of speeds, a watchdog of 10 Hz before the first of them",
        ("robot/ur_driver: watchdog_stops_the_arm", "safety/faults: fault_during_motion"),
    ),
    "5": Answer(
        "a blocking call cannot kick",
        "orders that wait are given at rest only, and before the watchdog; stop returns at once",
        ("robot/ur_driver: stop_returns_at_once",),
    ),
    "6": Answer(
        "an upload disarms the watchdog",
        "one upload, by an interface that is then closed; no path is ever uploaded",
        (
            "robot/ur_driver: watchdog_stops_the_arm",
            "robot/ur_driver: though_the_library_reconnects",
        ),
    ),
    "7": Answer(
        "five calls read a register before it is written",
        "none of them is used",
        ("safety/hazards: calls_that_lie_are_not_used",),
    ),
    "8": Answer(
        "getForwardKinematics(q, tcp) is wrong",
        "kinematics of our own",
        ("safety/hazards: calls_that_lie_are_not_used", "motion/kinematics: "),
    ),
    "9": Answer(
        "stopL, stopJ and setExternalForceTorque do something else",
        "servoStop and stopScript only",
        ("safety/hazards: calls_that_lie_are_not_used", "robot/ur_driver: stop_returns_at_once"),
    ),
    "10": Answer(
        "waitPeriod truncates",
        "an absolute clock; a tick that is late delays the path",
        (
            "safety/hazards: calls_that_lie_are_not_used",
            "robot/control_process: played_one_after_the_other",
        ),
    ),
    "11": Answer(
        "a NaN pose is accepted",
        "paths are checked as a whole and each set-point in the driver",
        (
            "robot/ur_driver: breaks_a_limit_is_not_sent",
            "safety/limits: set_point_that_breaks_a_limit",
        ),
    ),
    "12": Answer(
        "after a protective stop",
        "nothing unlocks or uploads again: a person does, and starts a new session",
        ("robot/ur_driver: protective_stop_is_told", "safety/hazards: calls_that_lie_are_not_used"),
    ),
    "13": Answer(
        "no force sensor on the UR10",
        "change since rest, from actual_TCP_force, which both generations have",
        ("safety/guards: each_guard_trips_alone",),
    ),
    "14": Answer(
        "the rate that was asked may not be had",
        "125 Hz, a divisor of both base rates; times come from the controller's clock",
        ("robot/control_process: path_is_followed_recorded_and_logged",),
    ),
    "S1": Answer(
        "dry run by default",
        "armed=True needs what a typed sentence makes; a plan to read",
        (
            "session/session: dry_run_unless_it_is_armed",
            "session/session: nobody_is_armed_without_a_confirmation",
            "session/session: only_the_sentence_confirms",
            "session/session: plan_tells_where_how_fast",
        ),
    ),
    "S2": Answer(
        "software is no safety function",
        "the plan says so; tool and payload are set and read back before each session",
        (
            "session/session: plan_tells_where",
            "robot/control_process: followed_recorded_and_logged",
        ),
    ),
    "S3": Answer(
        "pre-flight list",
        "safety/preflight.py",
        (
            "robot/control_process: arm_outside_its_box_is_not_armed",
            "session/session: no_controller_is_a_line",
        ),
    ),
    "S4": Answer(
        "every commanded point",
        "safety/limits.py, before the order, before the motion, and at each set-point",
        (
            "safety/limits: refused_as_a_whole",
            "safety/limits: box_s_margin",
            "safety/limits: leaves_the_reach",
        ),
    ),
    "S5": Answer(
        "the watchdog is kicked by the loop alone, while all guards are green",
        "the set-point is the kick",
        ("robot/ur_driver: watchdog_stops_the_arm", "safety/faults: fault_during_motion"),
    ),
    "S6": Answer(
        "guards at each tick",
        "safety/guards.py",
        ("safety/guards: every_guard_has_a_case", "safety/guards: each_guard_trips_alone"),
    ),
    "S7": Answer(
        "a guard stops the arm permanently",
        "the process ends; nothing resumes",
        ("session/session: stop_is_final", "robot/ur_driver: stop_returns_at_once_and_is_final"),
    ),
    "S8": Answer(
        "a camera, this computer or the link dies",
        "the fault matrix",
        ("safety/faults: fault_during_motion",),
    ),
    "S9": Answer(
        "processes of their own; every end of main is a stop",
        "end-of-file on the orders, signals, atexit",
        ("session/session: however_main_ends", "robot/control_process: signal_stops_the_arm"),
    ),
    "S10": Answer(
        "pouring",
        "the lip is the tool's centre; the way back is checked with the way there; a source is "
        "turned back upright where the robot is well",
        (
            "robot/ur_driver: lip_becomes_the_tool_s_centre",
            "motion/stir_paths: pour_turns_about_the_resting_lip",
            "robot/control_process: turned_back_before_the_arm_stops",
            "robot/control_process: not_turned_back_on_a_force",
        ),
    ),
    "S11": Answer(
        "a log of commands and of the reason of every stop",
        "events.jsonl: began, done, stopped, with the path's hash",
        ("robot/control_process: followed_recorded_and_logged", "session/session: is_the_reason"),
    ),
}
TESTS = Path(__file__).parents[1]
DRIVER = TESTS.parents[1] / "hardware" / "robot" / "ur.py"


@pytest.mark.parametrize("number", ANSWERS)
def test_every_hazard_has_a_test(number):
    for test in ANSWERS[number].tests:
        file, _, words = test.partition(": ")
        room, _, name = file.partition("/")
        text = (TESTS / room / f"test_{name}.py").read_text(encoding="utf-8")
        assert any(words in line for line in text.splitlines() if line.startswith("def test_"))


def test_no_hazard_is_left_out():
    assert list(ANSWERS) == [*map(str, range(1, 15)), *(f"S{k}" for k in range(1, 12))]


@pytest.mark.parametrize(
    "call",
    [
        *("getStepTime", "getActualJointPositionsHistory", "getJointTorques", "toolContact"),
        *("getActualToolFlangePose", "getForwardKinematics", "setExternalForceTorque"),
        *("stopL(", "stopJ(", "speedStop", "waitPeriod", "reconnect(", "reuploadScript"),
        *("moveL(", "moveJ(", "movePath", "speedL(", "unlockProtectiveStop", "ft_raw_wrench"),
    ],
)
def test_calls_that_lie_are_not_used(call):
    code = [line for line in DRIVER.read_text().splitlines() if "#" not in line]
    assert not any(f".{call}" in line for line in code)
