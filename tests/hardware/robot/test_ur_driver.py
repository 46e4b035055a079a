import os
import re
import subprocess
import sys
import time

import numpy as np
import pytest
from bolfi_liquids.hardware import emulated
from bolfi_liquids.hardware.arm import LinkLost
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.stir_paths import stir
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.robot.ur import URArm, URReader
from stepped_clock import SteppedClock
from ur_controller.process import FOLDER, ControllerProcess

pytest.importorskip("rtde_control")

# the others wait for what must come, and keep no time
keeps_time = pytest.mark.punctual

RIG = bundled_rig()
PATH = cup_frame(RIG.cup).to_base(stir(RIG).pose)
PERIOD = 1.0 / 125.0


@pytest.fixture
def emulator():
    with ControllerProcess.at_pose(RIG, stir(RIG).pose[0]) as process:
        yield process


@pytest.fixture
def arm(emulator):
    arm = URArm(RIG, emulator.address, "stirring")
    arm.connect()
    arm.take_control()
    yield arm
    arm.stop()
    arm.close()


def follow(arm, poses):
    deadline = time.monotonic()
    for pose in poses:
        arm.command(pose)
        deadline += PERIOD
        time.sleep(max(deadline - time.monotonic(), 0.0))


def wait_for(condition, timeout=20.0):
    end = time.monotonic() + timeout
    while time.monotonic() < end and not condition():
        time.sleep(0.005)
    return condition()


def is_refused(arm, pose):
    try:
        arm.command(pose)
    except LinkLost:
        return True
    return False


def wait_for_rest(emulator, timeout):
    return wait_for(lambda: emulator.admin.state().resting, timeout)


def test_a_lost_link_is_seen_at_once_and_stays_lost(emulator):
    reader = URReader(emulator.address, 125.0)
    reader.connect()
    assert reader.read().connected
    emulator.admin.drop()
    assert wait_for(lambda: not reader.read().connected)
    state = reader.read()
    # the getters go on with the last values: only these two facts tell
    assert reader.read().time == state.time
    assert not reader.read().connected
    reader.close()


def test_a_link_that_comes_back_by_itself_stays_lost(step_emulator, at_once):
    joints = emulated(RIG, stir(RIG).pose[0]).controller.joints
    emulator = step_emulator(SteppedClock(), joints=joints)
    reader = URReader(emulator.address, 125.0)
    arm = URArm(RIG, emulator.address, "stirring")
    for one in (reader, arm):
        one.connect()
    arm.take_control()
    emulator.drop()
    assert not reader.read().connected and not arm.read().connected
    emulator.reconnect()
    assert not reader.read().connected and not arm.read().connected
    with pytest.raises(LinkLost):
        arm.command(np.array(arm.read().pose))


@pytest.mark.parametrize("tool", ["stirring", "pouring"])
def test_taking_control_sets_tool_and_payload_and_moves_nothing(emulator, tool):
    """For a pour the lip becomes the tool's centre."""
    arm = URArm(RIG, emulator.address, tool)
    arm.connect()
    arm.take_control()
    assert arm.tcp() == pytest.approx(getattr(RIG.robot, f"{tool}_tcp"), abs=1e-9)
    assert wait_for(lambda: arm.payload().mass == pytest.approx(RIG.robot.payload))
    assert arm.payload().centre == pytest.approx(RIG.robot.payload_centre)
    assert arm.allows(PATH[0])
    assert not arm.allows(np.array([3.0, 0.0, 0.2, np.pi, 0.0, 0.0]))
    assert emulator.admin.motions() == 0
    arm.stop()
    arm.close()


@keeps_time
def test_the_watchdog_stops_the_arm_when_set_points_cease(arm, emulator):
    arm.arm_watchdog()
    follow(arm, PATH[250:330])
    assert not emulator.admin.state().resting
    assert wait_for_rest(emulator, 0.5)
    assert "watchdog" in emulator.admin.state().reason
    time.sleep(0.03)
    with pytest.raises(LinkLost):
        arm.command(PATH[330])


@keeps_time
def test_stop_returns_at_once_and_is_final(arm, emulator):
    arm.arm_watchdog()
    follow(arm, PATH[250:330])
    start = time.monotonic()
    arm.stop()
    assert time.monotonic() - start < 0.05
    with pytest.raises(LinkLost):
        arm.command(PATH[330])
    assert wait_for_rest(emulator, 0.3)
    moved = emulator.admin.motions()
    time.sleep(0.3)
    assert emulator.admin.motions() == moved
    assert emulator.admin.state().runtime_state == 1


def test_a_protective_stop_is_told_and_takes_no_set_point(arm, emulator):
    follow(arm, PATH[:3])
    emulator.admin.protective_stop()
    assert wait_for(lambda: arm.read().safety_bits & 1 << 2)
    moved = emulator.admin.motions()
    # the link that commands learns of the stop from packages of its own
    assert wait_for(lambda: is_refused(arm, PATH[3]))
    assert emulator.admin.motions() == moved


# in a process of its own, which the library may crash
DROPPED = """
import os, sys, time
from bolfi_liquids.hardware.motion.poses import cup_frame
from ur_controller.process import Admin
from bolfi_liquids.hardware.motion.stir_paths import stir
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware import emulated
from bolfi_liquids.hardware.arm import LinkLost
from bolfi_liquids.hardware.robot.ur import URArm

rig, address = bundled_rig(), sys.argv[1]
path = cup_frame(rig.cup).to_base(stir(rig).pose)
arm = URArm(rig, address, "stirring")
arm.connect()
arm.take_control()
arm.arm_watchdog()
for k in range(250, 330):
    arm.command(path[k])
    time.sleep(0.008)
Admin(address).drop()
taken = ""
for k in range(40):
    time.sleep(0.008)
    try:
        arm.command(path[330])
        taken += "+"
    except LinkLost:
        taken += "-"
print("taken", taken, flush=True)
os._exit(0)
"""


@keeps_time
def test_after_a_dropped_link_nothing_is_sent_though_the_library_reconnects(emulator):
    command = [sys.executable, "-c", DROPPED, emulator.address]
    where = os.environ | {"PYTHONPATH": FOLDER}  # what the script imports
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=where)
    # none once the loss is seen, unless the library crashed first: then nobody is left to send
    assert re.search(r"taken \+{0,4}-+$", done.stdout) or done.returncode < 0, done.stdout
    assert wait_for_rest(emulator, 0.3)
    # no program was started anew: the one that the watchdog guards has ended by it
    time.sleep(0.2)
    assert emulator.admin.state().runtime_state == 1
    assert "watchdog" in emulator.admin.state().reason


def test_no_controller_is_a_plain_error():
    with pytest.raises(RigError, match="robot.host = 127.99.99.99"):
        URReader("127.99.99.99", 125.0).connect()


def test_without_ur_rtde_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "rtde_receive", None)
    for version, words in (((3, 12), r"bolfi-liquids\[robot\]"), ((3, 13), "Python 3.13")):
        monkeypatch.setattr(sys, "version_info", version)
        with pytest.raises(ImportError, match=words):
            URReader("127.0.0.1", 125.0).connect()
