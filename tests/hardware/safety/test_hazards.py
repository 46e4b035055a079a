"""Each hazard of the client library and each safety requirement: its answer, and who tests it.

The numbers are those of the project's notes on ur_rtde 1.6.5 (hazards 1 to 14) and of its safety
requirements (S1 to S11). Tests are "file: words of its name".
"""

from pathlib import Path

CONTROL, DRIVER = "hardware/robot/control_process: ", "hardware/robot/ur_driver: "
SESSION, ARMS = "hardware/session/session: ", "extensions/arms: "
GUARDS, LIMITS = "hardware/safety/guards: ", "hardware/safety/limits: "
MATRIX = "hardware/safety/faults: fault_during_motion"
LIES = "hardware/safety/hazards: calls_that_lie_are_not_used"
ANSWERS = {
    # constructors hold Python's lock: the arm has a process of its own; one that hangs is ended
    "1": (f"{SESSION}control_process_that_hangs_is_ended", f"{SESSION}leaves_nothing_behind"),
    # getters repeat the last value, servoL says True on a dead link: it stays lost in the driver
    "2": (
        f"{DRIVER}lost_link_is_seen_at_once_and_stays_lost",
        f"{GUARDS}frozen_clock_is_silence",
        f"{GUARDS}late_packages_are_seen",
    ),
    # the control interface reconnects by itself, and crashes: nothing is sent after a loss
    "3": (f"{DRIVER}nothing_is_sent_though_the_library_reconnects", MATRIX),
    # without a watchdog the arm goes on when the client dies: one of 10 Hz before any set-point
    "4": (f"{DRIVER}watchdog_stops_the_arm", f"{ARMS}watchdog_stops_the_arm_for_good", MATRIX),
    # a blocking call cannot kick: orders that wait are given at rest only; stop returns at once
    "5": (f"{DRIVER}stop_returns_at_once",),
    # an upload disarms the watchdog: one upload, by an interface that is then closed
    "6": (f"{DRIVER}watchdog_stops_the_arm", f"{DRIVER}though_the_library_reconnects"),
    # five calls read a register before it is written; getForwardKinematics(q, tcp) is wrong
    "7": (LIES,),
    "8": (LIES, "hardware/motion/kinematics: "),
    # stopL, stopJ and setExternalForceTorque do something else: servoStop and stopScript only
    "9": (LIES, f"{DRIVER}stop_returns_at_once"),
    # waitPeriod truncates: an absolute clock; a tick that is late delays the path
    "10": (LIES, f"{CONTROL}played_one_after_the_other", f"{CONTROL}rehearsal_bears_a_stall"),
    # a NaN pose is accepted: paths are checked as a whole and each set-point in the driver
    "11": (
        f"{ARMS}set_point_that_breaks_a_limit",
        f"{LIMITS}set_point_that_breaks_a_limit",
    ),
    # after a protective stop nothing unlocks or uploads again: a person does
    "12": (f"{DRIVER}protective_stop_is_told", LIES),
    # no force sensor on the UR10: change since rest, from actual_TCP_force
    "13": (f"{GUARDS}each_guard_trips_alone",),
    # the rate that was asked may not be had: 125 Hz; times come from the controller's clock
    "14": (f"{CONTROL}path_is_followed_recorded_and_logged",),
    # dry run by default; armed=True needs what a typed sentence makes; a plan to read
    "S1": (
        f"{SESSION}dry_run_unless_it_is_armed",
        f"{SESSION}nobody_is_armed_without_a_confirmation",
        f"{SESSION}only_the_sentence_confirms",
        f"{SESSION}plan_tells_where_how_fast",
    ),
    # software is no safety function: the plan says so; tool and payload are set and read back
    "S2": (f"{SESSION}plan_tells_where", f"{ARMS}taking_control_sets_tool_and_payload"),
    # pre-flight list
    "S3": (
        f"{CONTROL}arm_outside_its_box_is_not_armed",
        f"{CONTROL}pose_that_the_controller_does_not_allow",
        f"{SESSION}no_controller_is_a_line",
        "hardware/safety/preflight: ",
    ),
    # every commanded point: before the order, before the motion, and at each set-point
    "S4": (
        f"{LIMITS}refused_as_a_whole",
        f"{LIMITS}box_s_margin",
        f"{LIMITS}leaves_the_reach",
        f"{CONTROL}path_that_cannot_be_followed",
        f"{CONTROL}pose_that_the_controller_does_not_allow",
    ),
    # the watchdog is kicked by the loop alone, while all guards are green
    "S5": (f"{DRIVER}watchdog_stops_the_arm", MATRIX),
    # guards at each tick
    "S6": (f"{GUARDS}every_guard_has_a_case", f"{GUARDS}each_guard_trips_alone"),
    # a guard stops the arm permanently
    "S7": (f"{SESSION}stop_is_final", f"{CONTROL}fault_stops_the_arm_for_good"),
    # a camera, this computer or the link dies
    "S8": (MATRIX, f"{CONTROL}fault_stops_the_arm_for_good"),
    # processes of their own; every end of main is a stop
    "S9": (f"{SESSION}however_main_ends", f"{CONTROL}signal_stops_the_arm"),
    # pouring: the lip is the tool's centre; a source is turned back where the robot is well
    "S10": (
        f"{DRIVER}taking_control_sets_tool",
        "hardware/motion/paths: pour_turns_about_the_resting_lip",
        f"{CONTROL}turned_back_before_the_arm_stops",
        f"{CONTROL}not_turned_back_on_a_force",
    ),
    # a log of commands and of the reason of every stop
    "S11": (f"{CONTROL}followed_recorded_and_logged", f"{SESSION}is_the_reason"),
}
TESTS = Path(__file__).parents[2]
SOURCE = TESTS.parent / "hardware" / "robot" / "ur.py"
LYING = (
    *("getStepTime", "getActualJointPositionsHistory", "getJointTorques", "toolContact"),
    *("getActualToolFlangePose", "getForwardKinematics", "setExternalForceTorque"),
    *("stopL(", "stopJ(", "speedStop", "waitPeriod", "reconnect(", "reuploadScript"),
    *("moveL(", "moveJ(", "movePath", "speedL(", "unlockProtectiveStop", "ft_raw_wrench"),
)


def test_every_hazard_has_its_tests():
    assert list(ANSWERS) == [*map(str, range(1, 15)), *(f"S{k}" for k in range(1, 12))]
    missing = []
    for number, tests in ANSWERS.items():
        for test in tests:
            file, _, words = test.partition(": ")
            room, _, name = file.rpartition("/")
            text = (TESTS / room / f"test_{name}.py").read_text(encoding="utf-8")
            lines = [line for line in text.splitlines() if line.startswith("def test_")]
            if not any(words in line for line in lines):
                missing.append((number, test))
    assert not missing


def test_calls_that_lie_are_not_used():
    code = "\n".join(line for line in SOURCE.read_text().splitlines() if "#" not in line)
    assert [call for call in LYING if f".{call}" in code] == []
