import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace

import numpy as np
import psutil
import pytest
from bolfi_liquids.hardware import emulated
from bolfi_liquids.hardware.errors import MotionRejected, RigError
from bolfi_liquids.hardware.motion.stir_paths import insert, retract, stir
from bolfi_liquids.hardware.recorder.events import read_events
from bolfi_liquids.hardware.recorder.samples import SAMPLES
from bolfi_liquids.hardware.robot.ur import URController
from bolfi_liquids.hardware.safety.preflight import failures
from bolfi_liquids.hardware.session.session import Session, SessionStopped
from bolfi_liquids.hardware.session.setup import (
    CONFIRMATION,
    Confirmation,
    SessionSetup,
    confirm,
    describe,
)
from short_rig import short_rig
from ur_controller.patience import PatientSetup
from ur_controller.process import FOLDER, ControllerProcess

# an arm that moves, and the watchdog of its controller; the others keep no time
keeps_time = pytest.mark.punctual

RIG = short_rig(approach_speed=0.1)
PLAN = [stir(RIG), retract(RIG)]


@pytest.fixture
def emulator():
    pytest.importorskip("rtde_control")
    with ControllerProcess.at_pose(RIG, PLAN[0].pose[0]) as process:
        yield process


def armed(emulator, directory):
    arm = URController(emulator.address)
    leave = confirm(describe(PLAN, RIG, "stirring"), CONFIRMATION, arm.address)
    return Session(PatientSetup(RIG, directory, arm, armed=True, confirmation=leave, plan=PLAN))


def lives(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def group_lives(group):
    """Whether any process of a group runs; orphans that nobody has reaped yet do not."""
    for one in psutil.process_iter():
        with suppress(psutil.NoSuchProcess, ProcessLookupError):
            if os.getpgid(one.pid) == group and one.status() != psutil.STATUS_ZOMBIE:
                return True
    return False


def kinds(directory, source):
    return [event["kind"] for event in read_events(directory) if event["source"] == source]


@keeps_time
def test_a_session_moves_an_emulated_arm_and_asks_nobody(tmp_path):
    arm = emulated(RIG, PLAN[0].pose[0]).controller
    with Session(SessionSetup(RIG, tmp_path / "whole", arm, armed=True, plan=PLAN)) as session:
        assert failures(session.preflight()) == ""
        for path in PLAN:
            session.follow(path)
        assert session.wait(timeout=30.0)
        session.close()  # which waits until the arm rests
    last = (tmp_path / "whole" / SAMPLES).read_text().splitlines()[-1].split(",")
    assert np.array(last[3:6], float) == pytest.approx(PLAN[-1].pose[-1, :3], abs=1e-3)
    with Session(SessionSetup(RIG, tmp_path / "killed", arm, armed=True, plan=PLAN)) as session:
        begin(session)
        os.kill(session._processes.control.process.pid, signal.SIGKILL)
        with pytest.raises(SessionStopped, match="control process killed by SIGKILL"):
            session.wait(timeout=5.0)


@pytest.mark.slow
@keeps_time
def test_a_session_follows_paths_records_them_and_leaves_nothing_behind(emulator, tmp_path):
    session = armed(emulator, tmp_path)
    assert not list(tmp_path.iterdir())
    with session:
        assert failures(session.preflight()) == ""
        numbers = [session.follow(path) for path in PLAN]
        assert numbers == [0, 1]
        assert not session.wait(timeout=0.1)
        session.status()
        assert session.wait(0, timeout=20.0)
        status = session.status()
        assert len(status.readings) > 10 and status.stopped is None
        assert status.pose is not None
        assert session.wait(timeout=20.0)
        assert [done.number for done in session.status().done] == [0, 1]
        pids = [child.process.pid for child in session._processes.children]
        start = time.monotonic()
    assert time.monotonic() - start < 1.5
    assert not any(lives(pid) for pid in pids)
    assert emulator.admin.state().resting
    assert kinds(tmp_path, "control")[-5:] == ["began", "done", "began", "done", "left"]
    rows = (tmp_path / SAMPLES).read_text().splitlines()
    assert [int(row.split(",")[0]) for row in rows[1:]] == list(range(len(rows) - 1))
    # at the end the arm is where the plan ends
    assert np.array(rows[-1].split(",")[3:6], float) == pytest.approx(
        PLAN[-1].pose[-1, :3], abs=1e-3
    )
    with pytest.raises(SessionStopped):
        session.follow(PLAN[0])


def test_a_session_that_was_not_started_takes_no_orders_and_starts_once(tmp_path):
    """What was closed would start processes again that nothing ends."""
    session = Session(SessionSetup(RIG, tmp_path / "new", plan=PLAN))
    assert "array" not in repr(session.setup)
    with pytest.raises(SessionStopped, match="not been started"):
        session.follow(PLAN[0])
    session.stop("nothing to stop")
    assert not session.status().closed
    session.close()
    assert session.status().closed
    with pytest.raises(SessionStopped):
        session.start()
    assert session._processes is None and not list(tmp_path.iterdir())


def test_a_confirmation_is_good_for_one_session(tmp_path):
    arm = URController("127.0.0.8")
    leave = confirm("plan", CONFIRMATION, arm.address)
    setup = SessionSetup(RIG, tmp_path / "first", arm, armed=True, confirmation=leave)
    setup.take_confirmation()
    with pytest.raises(RigError, match="earlier session"):
        Session(setup).start()
    with pytest.raises(RigError, match="earlier session"):
        replace(setup, directory=tmp_path / "second")
    assert not list(tmp_path.iterdir())


@keeps_time
def test_a_session_is_a_dry_run_unless_it_is_armed_and_records_all_the_same(emulator, tmp_path):
    with Session(SessionSetup(RIG, tmp_path, URController(emulator.address))) as session:
        assert failures(session.preflight()) == ""
        with pytest.raises(MotionRejected, match="dry run"):
            session.follow(PLAN[0])
        time.sleep(0.3)
    assert len((tmp_path / SAMPLES).read_text().splitlines()) > 20
    state = emulator.admin.state()
    assert emulator.admin.motions() == 0 and state.runtime_state == 1
    assert "program" not in state.reason


def test_nobody_is_armed_without_a_confirmation(tmp_path):
    other = URController("127.0.0.9")
    with pytest.raises(RigError, match="without a confirmation"):
        SessionSetup(RIG, tmp_path, other, armed=True)
    with pytest.raises(RigError, match="without a confirmation"):
        SessionSetup(RIG, tmp_path, other, armed=True, confirmation="yes")  # type: ignore[arg-type]
    leave = confirm("plan", CONFIRMATION, "127.0.0.8")
    with pytest.raises(RigError, match="is for 127.0.0.8, the controller is at 127.0.0.9"):
        SessionSetup(RIG, tmp_path, other, armed=True, confirmation=leave)


def test_only_the_sentence_confirms():
    for typed in ("", "y", "yes", CONFIRMATION.upper(), CONFIRMATION + "!"):
        with pytest.raises(RigError):
            confirm("plan", typed, "127.0.0.8")
    assert confirm("plan", f" {CONFIRMATION}\n", "127.0.0.8").plan == "plan"
    with pytest.raises(TypeError):
        Confirmation(object(), "plan", None)


def test_the_plan_tells_where_how_fast_and_how_long():
    text = describe([insert(RIG), *PLAN], RIG, "stirring")
    for words in ("3 motions", "x -1.6 to 2.0 cm", "(allowed -5.0 to 5.0)", "10.0 cm/s", "20 N"):
        assert words in text


def begin(session):
    session.follow(PLAN[0])
    end = time.monotonic() + 10.0
    while not session.status().began and time.monotonic() < end:
        time.sleep(0.01)
    time.sleep(0.8)


@pytest.mark.slow
@keeps_time
def test_a_path_that_breaks_a_limit_is_not_ordered(emulator, tmp_path):
    with armed(emulator, tmp_path) as session:
        high = PLAN[0]._replace(pose=PLAN[0].pose + [0, 0, 0.25, 0, 0, 0])
        with pytest.raises(MotionRejected, match="z = "):
            session.follow(high)
        # the caller may mend it and go on
        assert session.follow(PLAN[0]) == 0


@pytest.mark.slow
@keeps_time
def test_an_exception_stops_the_arm_and_is_the_reason(emulator, tmp_path):
    with pytest.raises(ZeroDivisionError):
        with armed(emulator, tmp_path) as session:
            begin(session)
            assert not emulator.admin.state().resting
            raise ZeroDivisionError("oh")
    assert emulator.admin.state().resting
    (event,) = [event for event in read_events(tmp_path) if event["kind"] == "stopped"]
    assert "ZeroDivisionError in the main process: oh" in event["reason"]


@keeps_time
def test_a_stop_is_final(emulator, tmp_path):
    with armed(emulator, tmp_path) as session:
        begin(session)
        session.stop("enough")
        with pytest.raises(SessionStopped, match="enough"):
            session.wait(timeout=5.0)
        assert session.status().stopped is not None
        with pytest.raises(SessionStopped, match="enough"):
            session.follow(PLAN[0])


@keeps_time
@pytest.mark.slow
def test_a_control_process_that_hangs_is_ended(emulator, tmp_path):
    with armed(emulator, tmp_path) as session:
        begin(session)
        os.kill(session._processes.control.process.pid, signal.SIGSTOP)
        with pytest.raises(SessionStopped, match="no sign of life of the control process"):
            session.wait(timeout=5.0)
    assert emulator.admin.state().resting


def test_no_controller_is_a_line_of_the_list(tmp_path):
    pytest.importorskip("rtde_control")
    with Session(SessionSetup(RIG, tmp_path, URController("127.88.77.66"))) as session:
        assert "controller: robot.host = 127.88.77.66" in failures(session.preflight())
        with pytest.raises(RigError, match="pre-flight"):
            session.pose()


FINDING = os.environ | {"PYTHONPATH": FOLDER}  # what the script imports

# a script that ends in the way that its second argument says, while the arm stirs
ENDING = """
import os, signal, sys, time
from pathlib import Path
from bolfi_liquids.hardware.motion.stir_paths import stir
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.robot.ur import URController
from bolfi_liquids.hardware.session.setup import CONFIRMATION, confirm
from bolfi_liquids.hardware.session.session import Session
from short_rig import short_rig
from ur_controller.patience import PatientSetup

if __name__ == "__main__":
    address, way, directory = sys.argv[1:]
    rig = bundled_rig()
    rig = rig.model_copy(update={"stirring": rig.stirring.model_copy(update={"rest": 0.1})})
    leave, arm = confirm("", CONFIRMATION, address), URController(address)
    setup = PatientSetup(rig, Path(directory), arm, armed=True, confirmation=leave)
    session = Session(setup)
    session.start()
    session.follow(stir(rig))
    while not session.status().began:
        time.sleep(0.01)
    time.sleep(0.8)
    if way == "exit":
        sys.exit(0)
    os.kill(os.getpid(), signal.Signals[way])
    time.sleep(5.0)
"""


@pytest.mark.slow
@pytest.mark.parametrize("way", ["exit", "SIGTERM", "SIGHUP", "SIGINT", "SIGKILL"])
def test_however_main_ends_the_arm_stops(emulator, tmp_path, way):
    script = tmp_path / "main.py"
    script.write_text(ENDING)
    recording = tmp_path / "recording"
    command = [sys.executable, str(script), emulator.address, way, str(recording)]
    subprocess.run(command, timeout=60.0, stderr=subprocess.DEVNULL, check=False, env=FINDING)
    end = time.monotonic() + 10.0
    while time.monotonic() < end and not emulator.admin.state().resting:
        time.sleep(0.02)
    assert emulator.admin.motions() > 0
    assert emulator.admin.state().resting
    assert "stopped" in kinds(recording, "control")


IMPATIENT = """
import signal
import sys
from pathlib import Path
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.robot.ur import URController
from bolfi_liquids.hardware.session.session import Session
from bolfi_liquids.hardware.session.setup import SessionSetup

if __name__ == "__main__":
    # a shell's background jobs are started deaf to it
    signal.signal(signal.SIGINT, signal.default_int_handler)
    arm = URController(sys.argv[1])
    with Session(SessionSetup(bundled_rig(), Path(sys.argv[2]), arm)) as session:
        print("started", flush=True)
        session.preflight()
        session.wait(0, timeout=20.0)
"""


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_ctrl_c_twice_leaves_no_process_behind_and_shows_no_child_s_inside(
    emulator, tmp_path, delay
):
    script = tmp_path / "main.py"
    script.write_text(IMPATIENT)
    command = [sys.executable, str(script), emulator.address, str(tmp_path / "recording")]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as main:
        assert main.stdout.readline() == "started\n"
        time.sleep(delay)
        for _ in range(2):
            os.killpg(main.pid, signal.SIGINT)  # as a terminal does
            time.sleep(0.3)
        _, errors = main.communicate(timeout=60.0)
    assert errors.count("Traceback") == 1 and errors.rstrip().endswith("KeyboardInterrupt")
    end = time.monotonic() + 10.0  # Python's own helper ends after main
    while time.monotonic() < end and group_lives(main.pid):
        time.sleep(0.02)
    assert not group_lives(main.pid)
