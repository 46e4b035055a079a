"""The real client against the emulator, each test with an emulator of its own.

None of them measures this computer's time: they wait for what must come, and take durations from
the robot's clock. `test_stepped` has the emulator's own times.
"""

import time
from functools import cached_property
from itertools import islice

import numpy as np
import pytest
from bolfi_liquids.hardware.emulated.arm import MAX_LATENESS
from bolfi_liquids.hardware.motion import kinematics
from bolfi_liquids.hardware.robot.ur import RTDE_FIELDS
from ur_controller.process import ControllerProcess

rtde_control = pytest.importorskip("rtde_control")
rtde_receive = pytest.importorskip("rtde_receive")

HOME = [0.3, -1.4, 1.6, -1.7, -1.5, 0.2]


class Robot:
    """An emulator and the interfaces of its client, each made when it is first used."""

    def __init__(self, emulator):
        self.emulator = emulator
        self.admin = emulator.admin

    @cached_property
    def receive(self):
        return rtde_receive.RTDEReceiveInterface(self.emulator.address, 125.0, RTDE_FIELDS)

    @cached_property
    def control(self):
        return rtde_control.RTDEControlInterface(self.emulator.address)

    def pose(self):
        return np.array(self.admin.state().pose)

    def release(self):
        # the destructors disconnect; a control interface that lives longer would reconnect
        self.__dict__.pop("control", None)
        self.__dict__.pop("receive", None)


@pytest.fixture
def robot():
    with ControllerProcess.start(joints=HOME) as emulator:
        robot = Robot(emulator)
        yield robot
        robot.release()


def wait_until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.005)
    return False


def moved(pose, *shift):
    return [*(np.array(pose[:3]) + shift), *pose[3:]]


@pytest.mark.parametrize("controller", ["cb3", "e-series"])
def test_both_generations_take_the_client(controller):
    with ControllerProcess.start(controller=controller, joints=HOME) as emulator:
        robot = Robot(emulator)
        assert robot.control.isProgramRunning()
        assert robot.receive.getRobotMode() == 7
        assert robot.receive.getSafetyStatusBits() == 1
        assert robot.receive.getActualQ() == pytest.approx(HOME)
        expected = kinematics.forward(kinematics.ARMS[controller], HOME)
        assert robot.receive.getActualTCPPose() == pytest.approx(expected)
        before = robot.receive.getTimestamp()
        first, *_, last = islice(robot.admin.stream(), 50)
        # both are of one tick, which is left out if it comes later than this
        assert last.time - first.time == pytest.approx(
            last.host - first.host, abs=MAX_LATENESS + 0.01
        )
        assert wait_until(lambda: robot.receive.getTimestamp() >= before + 0.1)
        robot.release()


def test_servo_l_follows_a_circle(robot):
    start, rate, radius, speed = robot.pose(), 125, 0.025, 0.05
    centre = start[:2] - [radius, 0.0]
    target, off = start, []
    for k in range(125):
        period = robot.control.initPeriod()
        angle = speed / radius * k / rate
        target = moved(start, radius * (np.cos(angle) - 1), radius * np.sin(angle), 0.0)
        assert robot.control.servoL(target, 0.5, 0.5, 1 / rate, 0.03, 2000)
        actual = np.array(robot.receive.getActualTCPPose())
        off.append((np.linalg.norm(actual[:2] - centre) - radius, actual[2] - start[2]))
        robot.control.waitPeriod(period)
    assert np.abs(off).max() < 0.5e-3
    # how far behind it is depends on the computer's load; test_stepped has the lag itself
    assert wait_until(lambda: np.linalg.norm((robot.pose() - target)[:3]) < 1e-5)
    assert robot.control.servoStop(5.0)
    assert robot.admin.state().at_rest
    # what the emulator does not know ends the program
    assert not robot.control.moveL(moved(start, 0, 0, 0.02), 0.1, 1.0)
    assert robot.admin.state().runtime_state == 1
    assert "not emulated" in robot.admin.state().reason


def test_the_script_answers_what_it_is_asked(robot):
    control, tcp = robot.control, [0.01, 0.02, 0.15, 0.0, 0.3, 0.0]
    assert control.setTcp(tcp)
    assert control.getTCPOffset() == pytest.approx(tcp)
    pose = kinematics.forward(kinematics.UR10, HOME, tcp=tcp)
    assert wait_until(lambda: robot.receive.getActualTCPPose() == pytest.approx(pose))
    assert control.isPoseWithinSafetyLimits(pose.tolist())
    assert not control.isPoseWithinSafetyLimits([2.0, 0, 0, 0, 0, 0])


def test_payload_is_told_and_force_is_noise_about_what_presses(robot):
    assert robot.control.setPayload(1.2, [0.0, 0.01, 0.05])
    assert wait_until(lambda: robot.receive.getPayload() == 1.2)
    assert robot.receive.getPayloadCog() == pytest.approx([0.0, 0.01, 0.05])
    robot.admin.force([0, 0, 30, 0, 0, 1])
    assert wait_until(lambda: robot.receive.getActualTCPForce()[2] > 25)
    readings = []
    for _ in range(60):
        readings.append(robot.receive.getActualTCPForce())
        time.sleep(0.009)
    force = np.array(readings)
    assert force.mean(axis=0) == pytest.approx([0, 0, 30, 0, 0, 1], abs=0.15)
    assert 0.12 < force[:, 0].std() < 0.3
    robot.admin.force([0] * 6)
    assert wait_until(lambda: abs(robot.receive.getActualTCPForce()[2]) < 2)


def test_no_second_client_may_write_the_same_registers(robot):
    assert robot.control.isProgramRunning()
    with pytest.raises(RuntimeError, match="already in use"):
        rtde_control.RTDEControlInterface(robot.emulator.address)
    assert robot.control.isProgramRunning()
