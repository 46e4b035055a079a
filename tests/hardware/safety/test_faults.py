import subprocess
import sys
from pathlib import Path

import pytest

FAULTS = Path(__file__).parents[2] / "benchmarks" / "hardware" / "faults.py"
NAMES = (
    "control process killed",
    "main process killed",
    "recorder killed",
    "link dropped",
    "link frozen",
    "camera stops",
    "camera frozen",
    "disk full",
    "force limit",
    "protective stop",
    "NaN target",
    "target outside the box",
    "loop overrun",
)


# what only the watchdog and the real library can show; `robot/test_control_process` has the arm's
# answer to the others on a stepped clock, and `session/test_session` main's end
IN_CI = ("control process killed", "link dropped")


@pytest.mark.punctual
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(one, marks=pytest.mark.slow if one in IN_CI else pytest.mark.minutes)
        for one in NAMES
    ],
)
def test_a_fault_during_motion_stops_the_arm_and_keeps_the_recording(name):
    pytest.importorskip("rtde_control")
    # the script holds a run against its bars: rest, restarts, samples kept, reason, processes
    command = [sys.executable, str(FAULTS), "--times", "1", "--seed", "100", "--latest", "0.5"]
    command += ["--only", name]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_script_has_no_other_faults():
    done = subprocess.run(
        [sys.executable, str(FAULTS), "--help"], capture_output=True, text=True, timeout=60.0
    )
    known = done.stdout.partition("{")[2].partition("}")[0]
    assert " ".join(known.split()) == ",".join(NAMES)
