"""The real client against the emulator: what it asks, faults of the link, the end of the client.

None of them measures this computer's time, but for those that are punctual.
"""

import os
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import kinematics
from bolfi_liquids.hardware.robot.ur import RTDE_FIELDS
from ur_controller.process import FOLDER, ControllerProcess

rtde_control = pytest.importorskip("rtde_control")
rtde_receive = pytest.importorskip("rtde_receive")

HOME = [0.3, -1.4, 1.6, -1.7, -1.5, 0.2]


@pytest.fixture
def emulator():
    with ControllerProcess(joints=HOME) as running:
        yield running


def until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not (met := condition()) and time.monotonic() < end:
        time.sleep(0.01)
    return met


@pytest.mark.parametrize("controller", ["cb3", "e-series"])
def test_both_generations_answer_what_the_client_asks(controller):
    with ControllerProcess(controller=controller, joints=HOME) as emulator:
        check_answers(emulator, kinematics.ARMS[controller])


def check_answers(emulator, arm):
    # the interfaces' destructors disconnect, before the emulator ends
    receive = rtde_receive.RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)
    control = rtde_control.RTDEControlInterface(emulator.address)
    assert control.isProgramRunning()
    assert (receive.getRobotMode(), receive.getSafetyStatusBits()) == (7, 1)
    assert receive.getActualQ() == pytest.approx(HOME)
    before = receive.getTimestamp()
    assert until(lambda: receive.getTimestamp() >= before + 0.1)
    tcp = [0.01, 0.02, 0.15, 0.0, 0.3, 0.0]
    assert control.setTcp(tcp)
    assert control.getTCPOffset() == pytest.approx(tcp)
    pose = kinematics.forward(arm, HOME, tcp=tcp)
    assert until(lambda: receive.getActualTCPPose() == pytest.approx(pose))
    assert control.isPoseWithinSafetyLimits(pose.tolist())
    assert not control.isPoseWithinSafetyLimits([2.0, 0, 0, 0, 0, 0])
    assert control.setPayload(1.2, [0.0, 0.01, 0.05])
    assert until(lambda: receive.getPayload() == 1.2)
    assert receive.getPayloadCog() == pytest.approx([0.0, 0.01, 0.05])
    emulator.admin.force([0, 0, 30, 0, 0, 1])
    assert until(lambda: receive.getActualTCPForce()[2] > 25)
    with pytest.raises(RuntimeError, match="already in use"):
        rtde_control.RTDEControlInterface(emulator.address)
    # what the emulator does not know ends the program
    assert not control.moveL(pose.tolist(), 0.1, 1.0)
    assert "not emulated" in emulator.admin.state().reason


# control interfaces live in processes of their own: after a lost link they may crash theirs
CLIENT = """
import sys, time
import rtde_control
from rtde_receive import RTDEReceiveInterface
control = rtde_control.RTDEControlInterface(sys.argv[1])
pose = RTDEReceiveInterface(sys.argv[1], 125.0, ["actual_TCP_pose"]).getActualTCPPose()
def servo(target):
    return control.servoL(target, 0.5, 0.5, 0.008, 0.1, 300)
"""
RISE = """
print("moving", flush=True)
while True:
    pose[2] += 0.05 * 0.008
    servo(pose)
    time.sleep(0.008)
"""


@pytest.fixture
def client(emulator):
    """Starts the client with some code, in a process of its own."""
    started = []

    def start(code):
        command = [sys.executable, "-c", CLIENT + code, emulator.address]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        started.append(subprocess.Popen(command, text=True, **pipes))
        started[-1].stdout.readline()
        return started[-1]

    yield start
    for one in started:
        one.kill()
        one.communicate()


def moving(admin):
    until(lambda: admin.state().velocity[2] >= 0.03)
    return not admin.state().resting


@pytest.mark.punctual
@pytest.mark.parametrize("fault", ["killed", "frozen"])
def test_the_watchdog_stops_the_arm_of_a_client_that_kicks_no_more(emulator, client, fault):
    admin, running = emulator.admin, client("control.setWatchdog(10.0)" + RISE)
    assert moving(admin)
    time.sleep(0.2)
    assert moving(admin)  # a client that kicks is left alone
    if fault == "killed":
        running.send_signal(signal.SIGKILL)
    else:
        admin.freeze(0.6)
    assert until(lambda: admin.state().resting, 0.5)
    assert "watchdog" in admin.state().reason and admin.state().runtime_state == 1
    time.sleep(0.7)  # thawed: what was sent meanwhile arrives, and moves nothing
    assert admin.motions() == 1


def test_without_a_watchdog_a_killed_client_s_program_goes_on(emulator, client):
    running = client(RISE)
    assert moving(emulator.admin)
    running.send_signal(signal.SIGKILL)
    assert not until(lambda: emulator.admin.state().runtime_state == 1, 0.5)


@pytest.mark.parametrize(
    "target",
    ["[float('nan')] * 6", "[2.0, 0.0, 0.5, 0, 3.1, 0]", "[-pose[0], -pose[1], *pose[2:]]"],
    ids=["NaN", "unreachable", "too fast"],
)
def test_impossible_motions_are_protective_stops(emulator, client, target):
    client(f"servo({target})\nprint('sent', flush=True)\ntime.sleep(60)")
    assert until(lambda: "protective stop" in emulator.admin.state().reason)
    state = emulator.admin.state()
    assert state.safety_bits & 1 << 2 and np.isfinite(state.joints).all()
    assert until(lambda: emulator.admin.state().resting, 5.0)


@pytest.mark.slow
@pytest.mark.punctual
def test_receiver_sees_a_freeze_and_a_drop_as_the_client_s_source_says(emulator):
    receive = rtde_receive.RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)
    emulator.admin.freeze(0.4)
    time.sleep(0.05)
    held = receive.getTimestamp()
    time.sleep(0.2)
    # the last value for ever, and a link that looks sound
    assert receive.getTimestamp() == held and receive.isConnected()
    time.sleep(0.3)
    assert receive.getTimestamp() > held + 0.3
    emulator.admin.drop()
    time.sleep(0.1)
    assert not receive.isConnected()
    del receive


@pytest.mark.slow
def test_receiver_gives_up_a_frozen_link_after_2_5_s(emulator):
    receive = rtde_receive.RTDEReceiveInterface(emulator.address, 125.0, RTDE_FIELDS)
    emulator.admin.freeze(4.0)
    time.sleep(1.5)
    assert receive.isConnected()
    time.sleep(1.7)
    assert not receive.isConnected()
    del receive


PARENT = """
import time
from ur_controller.process import ControllerProcess
emulator = ControllerProcess()
print(emulator.address, flush=True)
time.sleep(60)
"""


def test_it_ends_with_its_parent():
    where = os.environ | {"PYTHONPATH": FOLDER}
    with subprocess.Popen(
        [sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True, env=where
    ) as parent:
        address = parent.stdout.readline().strip()
        socket.create_connection((address, 29999), 5.0).close()
        parent.kill()

    def gone():
        try:
            socket.create_connection((address, 29999), 5.0).close()
        except OSError:
            return True
        return False

    assert until(gone)
