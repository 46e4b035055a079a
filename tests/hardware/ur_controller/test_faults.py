"""Faults of the link, of the client and of the operator, and what the emulated arm does then.

Those that are punctual need the real library to keep time. `test_stepped` has how soon
the arm rests, and after what time a watchdog or a protective stop ends.
"""

import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
from bolfi_liquids.hardware.robot.ur import RTDE_FIELDS
from ur_controller.process import ControllerProcess

HOME = [0.3, -1.4, 1.6, -1.7, -1.5, 0.2]

# control interfaces live in processes of their own: after a lost link they may crash theirs
CLIENT = """
import sys, time
import rtde_control
from rtde_receive import RTDEReceiveInterface
control = rtde_control.RTDEControlInterface(sys.argv[1])
pose = RTDEReceiveInterface(sys.argv[1], 125.0, ["actual_TCP_pose"]).getActualTCPPose()
def servo(target):
    return control.servoL(target, 0.5, 0.5, 0.008, 0.1, 300)
def say(*values):
    print(*values, flush=True)
def heard():
    return sys.stdin.readline()
"""


@pytest.fixture
def emulator():
    with ControllerProcess.start(joints=HOME, options={"unlock-after": 1.0}) as emulator:
        yield emulator


class Client:
    """The control interface in a process of its own, which runs `code`."""

    def __init__(self, emulator, code):
        pytest.importorskip("rtde_control")
        self.process = subprocess.Popen(
            [sys.executable, "-c", CLIENT + code, emulator.address],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def hear(self):
        return self.process.stdout.readline().strip()

    def say(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()


def until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not (met := condition()) and time.monotonic() < end:
        time.sleep(0.01)
    return met


def rests_within(admin, seconds):
    return until(lambda: admin.state().at_rest, seconds)


def moving(admin):
    until(lambda: admin.state().speed[2] >= 0.03)
    return not admin.state().at_rest


RISE = """
say("moving")
while True:
    pose[2] += 0.05 * 0.008
    servo(pose)
    time.sleep(0.008)
"""


@pytest.mark.punctual
def test_watchdog_stops_the_arm_of_a_killed_client(emulator):
    with Client(emulator, "control.setWatchdog(10.0)" + RISE) as client:
        assert client.hear() == "moving"
        assert moving(emulator.admin)
        time.sleep(0.2)
        assert moving(emulator.admin)  # a client that kicks is left alone
        client.process.send_signal(signal.SIGKILL)
        assert rests_within(emulator.admin, 0.5)
    state = emulator.admin.state()
    assert state.runtime_state == 1
    assert "watchdog" in state.reason
    time.sleep(0.3)
    assert emulator.admin.motions() == 1


def test_without_a_watchdog_a_killed_client_s_program_goes_on(emulator):
    with Client(emulator, RISE) as client:
        assert client.hear() == "moving"
        assert moving(emulator.admin)
        client.process.send_signal(signal.SIGKILL)
        assert not until(lambda: emulator.admin.state().runtime_state == 1, 0.5)


@pytest.mark.punctual
def test_watchdog_stops_the_arm_behind_a_frozen_link(emulator):
    with Client(emulator, "control.setWatchdog(10.0)" + RISE) as client:
        assert client.hear() == "moving"
        assert moving(emulator.admin)
        emulator.admin.freeze(0.6)
        assert rests_within(emulator.admin, 0.5)
        time.sleep(0.4)  # thawed: what was sent meanwhile arrives, and moves nothing
        assert emulator.admin.motions() == 1


RESUME = """
pose[2] += 0.05
servo(pose)
say("moving")
heard()
say(servo(pose), control.setWatchdog(10.0))
heard()
say(control.reuploadScript())
time.sleep(0.3)
say(control.isProgramRunning())
say(servo(pose))
heard()
"""


@pytest.mark.punctual  # the client learns of the stop by a link of its own
def test_nothing_resumes_after_a_protective_stop(emulator):
    with Client(emulator, RESUME) as client:
        assert client.hear() == "moving"
        assert moving(emulator.admin)
        emulator.admin.protective_stop()
        assert dashboard(emulator, "unlock protective stop").startswith("Cannot unlock")
        assert rests_within(emulator.admin, 5.0)
        state = emulator.admin.state()
        assert state.safety_bits & 1 << 2
        assert not state.safety_bits & 1
        assert state.runtime_state == 1
        client.say()
        assert client.hear() == "False False"
        assert dashboard(emulator, "safetymode") == "Safetymode: PROTECTIVE_STOP"
        released = "Protective stop releasing"
        assert until(lambda: dashboard(emulator, "unlock protective stop") == released)
        time.sleep(0.2)
        state = emulator.admin.state()
        assert (state.safety_bits, state.runtime_state, state.at_rest) == (1, 1, True)
        assert emulator.admin.motions() == 1
        client.say()
        assert [client.hear() for _ in range(3)] == ["True"] * 3
        assert until(lambda: emulator.admin.motions() == 2)


def dashboard(emulator, line):
    with socket.create_connection((emulator.address, 29999), timeout=5) as link:
        lines = link.makefile("rw", encoding="utf-8")
        assert lines.readline().startswith("Connected")
        lines.write(line + "\n")
        lines.flush()
        return lines.readline().strip()


@pytest.mark.parametrize(
    "command",
    [
        "control.servoL([float('nan')] * 6, 0.5, 0.5, 0.008, 0.1, 300)",
        "control.servoL([2.0, 0.0, 0.5, 0, 3.1, 0], 0.5, 0.5, 0.008, 0.1, 300)",
        "control.servoL([-pose[0], -pose[1], *pose[2:]], 0.5, 0.5, 0.008, 0.1, 300)",
    ],
    ids=["NaN", "unreachable", "too fast"],
)
def test_impossible_motions_are_protective_stops(emulator, command):
    with Client(emulator, f"{command}\nsay('sent')\nheard()") as client:
        assert client.hear() == "sent"
        assert until(lambda: "protective stop" in emulator.admin.state().reason)
        state = emulator.admin.state()
        assert state.safety_bits & 1 << 2
        assert np.isfinite(state.joints).all()
        assert rests_within(emulator.admin, 5.0)


@pytest.mark.slow
@pytest.mark.punctual
def test_receiver_sees_a_freeze_and_a_drop_as_the_client_s_source_says(emulator):
    rtde_receive = pytest.importorskip("rtde_receive")
    receive = rtde_receive.RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)
    emulator.admin.freeze(0.4)
    time.sleep(0.05)
    held = receive.getTimestamp()
    time.sleep(0.2)
    # the last value for ever, and a link that looks sound
    assert receive.getTimestamp() == held
    assert receive.isConnected()
    time.sleep(0.3)
    assert receive.getTimestamp() > held + 0.3
    emulator.admin.drop()
    time.sleep(0.1)
    assert not receive.isConnected()
    held = receive.getTimestamp()
    time.sleep(0.05)
    assert receive.getTimestamp() == held
    assert emulator.admin.state().at_rest
    del receive


@pytest.mark.slow
def test_receiver_gives_up_a_frozen_link_after_2_5_s(emulator):
    rtde_receive = pytest.importorskip("rtde_receive")
    receive = rtde_receive.RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)
    emulator.admin.freeze(4.0)
    time.sleep(1.5)
    assert receive.isConnected()
    time.sleep(1.7)
    assert not receive.isConnected()
    del receive


def test_senseless_bytes_close_only_their_own_connection(emulator):
    for port, data in ((30004, b"\x00\x01\x00"), (30004, b"\x00\x05\x99ab"), (29997, b"{\n")):
        with socket.create_connection((emulator.address, port), timeout=5) as link:
            link.sendall(data)
            answer = link.recv(1000)
            assert answer == b"" or b"error" in answer
    assert emulator.admin.state().runtime_state == 1
