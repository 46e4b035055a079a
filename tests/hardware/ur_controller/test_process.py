"""The emulator as a process: its options, its end, and what it costs."""

import os
import signal
import subprocess
import sys
import time

import pytest
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.robot.ur import RTDE_FIELDS
from ur_controller.process import FOLDER, ControllerProcess

HOME = [0.3, -1.4, 1.6, -1.7, -1.5, 0.2]


@pytest.fixture
def emulator():
    with ControllerProcess.start(joints=HOME) as emulator:
        yield emulator


def test_only_this_computer_and_free_ports_are_served(emulator):
    with pytest.raises(RigError, match=r"192\.168\.1\.5.*127\.0\.0\.0/8"):
        ControllerProcess.start("192.168.1.5")
    with pytest.raises(RigError, match="port 30004 cannot be used: Address already in use"):
        ControllerProcess.start(emulator.address)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"joints": [0.0] * 5}, "joints must be six finite numbers"),
        ({"options": {"rate": 0}}, "rate must be between"),
    ],
)
def test_senseless_options_are_named(options, message):
    with pytest.raises(RigError, match=message):
        ControllerProcess.start(**options)


def gone(pid, seconds=20.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            with open(f"/proc/{pid}/stat") as file:
                if file.read().rpartition(")")[2].split()[0] == "Z":
                    return True
        except FileNotFoundError:
            return True
        time.sleep(0.02)
    return False


PARENT = """
import time
from ur_controller.process import ControllerProcess
emulator = ControllerProcess.start()
print(emulator.pid, flush=True)
time.sleep(60)
"""


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="looks into /proc")
def test_it_ends_with_its_parent():
    command = [sys.executable, "-c", PARENT]
    where = os.environ | {"PYTHONPATH": FOLDER}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=where) as parent:
        child = int(parent.stdout.readline())
        assert not gone(child, 0.2)
        parent.kill()
        assert gone(child)


def test_it_ends_at_sigterm(emulator):
    os.kill(emulator.pid, signal.SIGTERM)
    assert gone(emulator.pid)


@pytest.mark.slow
@pytest.mark.punctual
@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="looks into /proc")
def test_it_needs_at_most_a_quarter_of_a_core():
    rtde_control = pytest.importorskip("rtde_control")
    rtde_receive = pytest.importorskip("rtde_receive")
    with ControllerProcess.start(joints=HOME) as emulator:
        receive = rtde_receive.RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)
        control = rtde_control.RTDEControlInterface(emulator.address)
        pose = receive.getActualTCPPose()
        before = processor_time(emulator.pid)
        for _ in range(375):
            pose[2] += 0.02 * 0.008
            control.servoL(pose, 0.5, 0.5, 0.008, 0.1, 300)
            time.sleep(0.008)
        assert processor_time(emulator.pid) - before < 0.25 * 3.0
        assert "late" not in emulator.notes()
        del control, receive


def processor_time(pid):
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
