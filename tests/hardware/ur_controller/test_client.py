"""The real client against the emulator, each test with an emulator of its own.

None of them measures this computer's time: they wait for what must come, and take durations from
the robot's clock. `test_stepped` has the emulator's own times.
"""

import time
from contextlib import ExitStack
from functools import cached_property
from itertools import islice

import numpy as np
import pytest
from bolfi_liquids.hardware.emulated.arm import MAX_LATENESS
from bolfi_liquids.hardware.motion import kinematics, poses
from ur_controller.process import ControllerProcess

rtde_control = pytest.importorskip("rtde_control")
rtde_receive = pytest.importorskip("rtde_receive")
rtde_io = pytest.importorskip("rtde_io")

HOME = [0.3, -1.4, 1.6, -1.7, -1.5, 0.2]
UP, ACCELERATION = 0.05, 0.5


class Robot:
    """An emulator and the interfaces of its client, each made when it is first used."""

    def __init__(self, emulator):
        self.emulator = emulator
        self.admin = emulator.admin

    @cached_property
    def receive(self):
        return rtde_receive.RTDEReceiveInterface(self.emulator.address)

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
    with ControllerProcess.start(joints=HOME, options={"unlock-after": 0.2}) as emulator:
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


def angle_between(first, second):
    a, b = poses.rotation_matrix(first[3:]), poses.rotation_matrix(second[3:])
    return np.linalg.norm(poses.rotation_vector(a.T @ b))


def states_until_rest(admin):
    """States of every tick from the first motion to rest."""
    states, stream = [], admin.stream()
    for state in stream:
        if not state.at_rest:
            states.append(state)
        elif states:
            stream.close()
    return states


@pytest.mark.parametrize(
    ("controller", "arm", "has_sensor"), [("cb3", "ur10", False), ("e-series", "ur10e", True)]
)
def test_both_generations_take_the_client(controller, arm, has_sensor):
    with ControllerProcess.start(controller=controller, joints=HOME) as emulator:
        robot = Robot(emulator)
        assert robot.control.isProgramRunning()
        assert robot.receive.getRobotMode() == 7
        assert robot.receive.getSafetyStatusBits() == 1
        assert robot.receive.getActualQ() == pytest.approx(HOME)
        expected = kinematics.forward(kinematics.ARMS[arm], HOME)
        assert robot.receive.getActualTCPPose() == pytest.approx(expected)
        if has_sensor:
            assert np.abs(robot.receive.getFtRawWrench()).max() < 5.0
        else:
            with pytest.raises(RuntimeError, match="ft_raw_wrench"):
                robot.receive.getFtRawWrench()
        before = robot.receive.getTimestamp()
        first, *_, last = islice(robot.admin.stream(), 50)
        # both are of one tick, which is left out if it comes later than this
        assert last.time - first.time == pytest.approx(
            last.host - first.host, abs=MAX_LATENESS + 0.01
        )
        assert wait_until(lambda: robot.receive.getTimestamp() >= before + 0.1)
        robot.release()


def test_move_l_goes_straight_within_speed_and_acceleration(robot):
    start = robot.pose()
    goal = moved(start, 0.03, -0.04, 0.08)
    goal[5] += 0.05
    assert robot.control.moveL(goal, 0.1, ACCELERATION, True)
    states = states_until_rest(robot.admin)
    end = robot.pose()
    assert end[:3] == pytest.approx(goal[:3], abs=1e-4)
    assert angle_between(end, goal) < 1e-4
    speeds = np.array([state.speed[:3] for state in states])
    assert 0.09 < np.linalg.norm(speeds, axis=1).max() < 0.1 * 1.001
    rates = np.linalg.norm(np.diff(speeds, axis=0), axis=1) / 0.008
    assert rates.max() < ACCELERATION * 1.01
    way = (np.array(goal[:3]) - start[:3]) / np.linalg.norm(np.array(goal[:3]) - start[:3])
    off = np.array([state.pose[:3] for state in states]) - start[:3]
    assert np.linalg.norm(off - np.outer(off @ way, way), axis=1).max() < 1e-6


def test_move_j_arrives_with_all_joints_together(robot):
    goal = np.array(HOME) + [0.1, 0.05, -0.1, 0.02, 0.3, -0.2]
    assert robot.control.moveJ(goal.tolist(), 0.8, 2.0, True)
    states = states_until_rest(robot.admin)
    joints = np.array([state.joints for state in states])
    assert robot.admin.state().joints == pytest.approx(goal)
    shares = (joints - HOME) / (goal - HOME)
    assert np.ptp(shares, axis=1).max() < 1e-9
    assert np.abs(np.diff(joints, axis=0)).max() / 0.008 < 0.8 * 1.001


def test_a_path_reports_its_progress_and_stops_the_watchdog(robot):
    robot.control.setWatchdog(5.0)
    start = robot.pose()
    path = [[*moved(start, 0.02 * k, 0, 0.02 * (k % 2)), 0.08, 1.0, 0.0] for k in (1, 2, 3)]
    assert robot.control.moveL(path, True)
    seen = []
    assert wait_until(
        lambda: seen.append(robot.control.getAsyncOperationProgress()) or seen[-1] < 0
    )
    assert sorted(set(seen) - {seen[-1]}) == [0, 1, 2]
    # the path restarted the program, and with that the watchdog is gone: nobody kicked it
    assert robot.control.isProgramRunning()
    assert robot.pose()[:3] == pytest.approx(path[-1][:3], abs=1e-4)


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
    # how far behind it is depends on the computer's load; test_emulator_motion has the lag itself
    assert wait_until(lambda: np.linalg.norm((robot.pose() - target)[:3]) < 1e-5)
    assert robot.control.servoStop(5.0)
    assert robot.admin.state().at_rest


def test_speed_l_and_speed_j_reach_their_speed_and_stop(robot):
    assert robot.control.speedL([0.0, 0.0, UP, 0, 0, 0], ACCELERATION)
    assert wait_until(lambda: robot.admin.state().speed[2] == pytest.approx(UP, abs=1e-6))
    assert robot.control.speedStop(5.0)
    stopped = robot.admin.state()
    assert stopped.at_rest
    assert robot.control.speedJ([0, 0, 0, 0, 0, 0.2], 1.0)
    assert wait_until(lambda: np.linalg.norm(robot.admin.state().speed[3:]) > 0.19)
    assert robot.control.speedStop(5.0)
    joints = robot.admin.state().joints
    assert joints[:5] == pytest.approx(stopped.joints[:5])
    assert joints[5] > stopped.joints[5] + 0.015


@pytest.mark.slow
def test_the_speed_slider_slows_a_move_down(robot):
    slider = rtde_io.RTDEIOInterface(robot.emulator.address)
    assert slider.setSpeedSlider(0.25)
    assert wait_until(lambda: robot.receive.getTargetSpeedFraction() == 0.25)
    assert robot.receive.getSpeedScaling() == 0.25
    goal = moved(robot.pose(), 0.0, 0.0, 0.02)
    assert robot.control.moveL(goal, 0.1, 1.0, True)
    # 0.02 m at 0.1 m/s with ramps of 0.1 s, in a time four times slower
    assert 0.008 * len(states_until_rest(robot.admin)) == pytest.approx(4 * 0.3, abs=0.05)
    assert robot.pose()[:3] == pytest.approx(goal[:3], abs=1e-4)


def test_asynchronous_stop_ends_a_move_on_its_line(robot):
    start = robot.pose()
    robot.control.moveL(moved(start, 0.0, 0.0, 0.2), 0.1, 1.0, True)
    assert wait_until(lambda: robot.admin.state().speed[2] > 0.09)
    robot.control.stopL(2.0, True)
    assert wait_until(lambda: robot.admin.state().at_rest)
    assert robot.pose()[:2] == pytest.approx(start[:2], abs=1e-4)
    assert robot.pose()[2] < start[2] + 0.1
    assert wait_until(lambda: robot.control.getAsyncOperationProgress() < 0)


def test_a_second_thread_that_moves_the_arm_ends_the_program(robot):
    robot.control.servoL(robot.pose().tolist(), 0.5, 0.5, 0.008, 0.1, 300)
    assert not robot.control.moveL(moved(robot.pose(), 0, 0, 0.02), 0.1, 1.0)
    assert robot.admin.state().runtime_state == 1
    assert "already controlling" in robot.admin.state().reason


def test_questions_are_answered_by_the_kinematics(robot):
    control, joints = robot.control, np.array(HOME)
    tcp = [0.01, 0.02, 0.15, 0.0, 0.3, 0.0]
    assert control.setTcp(tcp)
    assert control.getTCPOffset() == pytest.approx(tcp)
    pose = kinematics.forward(kinematics.UR10, joints, tcp=tcp)
    assert control.getForwardKinematics() == pytest.approx(pose)
    # hazard 8 of the client: with a TCP of zeros it would leave the tool to stale registers
    assert control.getForwardKinematics(HOME, tcp) == pytest.approx(pose)
    assert control.getInverseKinematics(pose.tolist()) == pytest.approx(HOME)
    near = (joints + 0.05).tolist()
    assert control.getInverseKinematics(pose.tolist(), near) == pytest.approx(HOME)
    assert control.isPoseWithinSafetyLimits(pose.tolist())
    assert not control.isPoseWithinSafetyLimits([2.0, 0, 0, 0, 0, 0])
    other = [0.1, 0.0, -0.2, 0.5, 0.0, 0.0]
    assert control.poseTrans(tcp, other) == pytest.approx(poses.compose(tcp, other))
    assert wait_until(control.isSteady)


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
    assert robot.control.zeroFtSensor()
    assert wait_until(lambda: abs(robot.receive.getActualTCPForce()[2]) < 2)
    robot.admin.force([0] * 6)
    assert wait_until(lambda: robot.receive.getActualTCPForce()[2] < -25)


def test_no_second_client_may_write_the_same_registers(robot):
    assert robot.control.isProgramRunning()
    with pytest.raises(RuntimeError, match="already in use"):
        rtde_control.RTDEControlInterface(robot.emulator.address)
    assert robot.control.isProgramRunning()


@pytest.mark.slow
def test_several_emulators_move_independently():
    with ExitStack() as stack:
        kinds = ("cb3", "cb3", "e-series")
        emulators = [
            stack.enter_context(ControllerProcess.start(controller=kind, joints=HOME))
            for kind in kinds
        ]
        robots = [Robot(emulator) for emulator in emulators]
        starts = [robot.pose() for robot in robots]
        for k, robot in enumerate(robots):
            assert robot.control.moveL(moved(starts[k], 0, 0, 0.01 * k), 0.1, 1.0, True)
        for k, robot in enumerate(robots):
            goal = starts[k][2] + 0.01 * k
            assert wait_until(lambda r=robot, z=goal: r.pose()[2] == pytest.approx(z, abs=1e-4))
            assert robot.admin.motions() == (k > 0)
        for robot in robots:
            robot.release()
