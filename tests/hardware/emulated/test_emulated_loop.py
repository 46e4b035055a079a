"""The motion loop and the emulated arm, on a clock that the test steps, and as a session."""

import os
import signal
import time

import numpy as np
import pytest
from bolfi_liquids.hardware import Session, SessionSetup, SessionStopped, emulated
from bolfi_liquids.hardware.emulated.rig import patient
from bolfi_liquids.hardware.motion.pour_paths import pour_path, ready_to_pour
from bolfi_liquids.hardware.motion.stir_paths import retract, stir
from bolfi_liquids.hardware.recorder.samples import SAMPLES
from bolfi_liquids.hardware.robot.orders import (
    Assignment,
    Began,
    Checked,
    Done,
    Follow,
    Leave,
    Left,
    Stop,
    Stopped,
)
from bolfi_liquids.hardware.safety.preflight import failures
from short_rig import short_rig
from stepped_clock import SteppedClock

RIG = short_rig()
PATH = stir(RIG)
PERIOD = 1.0 / RIG.robot.rate


@pytest.fixture
def loop(stepped_loop, tmp_path):
    """Makes the loop of a rig whose arm is emulated, at rest where a path starts."""

    def make(rig, path, tool="stirring"):
        controller = emulated(rig, path.pose[0], tool=tool).controller
        clock = SteppedClock(controller.begun)
        arm, probes = controller._replace(clock=clock), np.empty((0, 6))
        to = Assignment(rig, arm, tool, True, str(tmp_path), probes, cameras=False)
        return stepped_loop(to, clock)

    return make


def test_a_path_is_followed_and_recorded_with_a_sample_for_each_tick(loop):
    one = loop(RIG, PATH)
    one.when(Checked, lambda: one.orders.put(Follow(PATH)))
    one.when(Done, lambda: one.orders.put(Leave()))
    assert one.run() == 0
    assert [type(report) for report in one.reports] == [Checked, Began, Done, Left]
    checked, began, done, _ = one.reports
    assert failures(checked.checks) == ""
    assert done.robot_time - began.robot_time == pytest.approx(PATH.duration, abs=2.5 * PERIOD)
    steps = np.diff([row.time for row in one.rows if row.stirring]) / PERIOD
    assert sorted(np.round(steps, 6))[:-1] == [1.0] * (len(steps) - 1) and max(steps) < 2.1
    stirred = np.array([row[3:6] for row in one.rows if row.stirring])
    away = [np.linalg.norm(PATH.pose[:, :3] - place, axis=1).min() for place in stirred[::20]]
    assert max(away) < 0.003
    assert np.ptp(stirred[:, 0]) == pytest.approx(np.ptp(PATH.pose[:, 0]), abs=0.003)


@pytest.mark.parametrize("stall", [0.06, 0.3, 0.9])
def test_a_rehearsal_bears_a_stall_in_the_middle_of_a_motion(loop, stall):
    one = loop(patient(RIG), PATH)
    one.when(Checked, lambda: one.orders.put(Follow(PATH)))
    one.when(Began, lambda: one.clock.sleep(stall), after=1.0)
    one.when(Done, lambda: one.orders.put(Leave()))
    assert one.run() == 0
    began, done = one.reported(Began)[0], one.reported(Done)[0]
    # the path is delayed, and not hurried
    late = done.robot_time - began.robot_time - PATH.duration
    assert late == pytest.approx(stall, abs=4 * PERIOD)


@pytest.mark.parametrize("stall", [0.06, 0.3])
def test_the_rig_s_own_limits_bear_none(loop, stall):
    one = loop(RIG, PATH)
    one.when(Checked, lambda: one.orders.put(Follow(PATH)))
    one.when(Began, lambda: one.clock.sleep(stall), after=1.0)
    assert one.run() == 1
    (stopped,) = one.reported(Stopped)
    assert stopped.guard == "overrun"


def test_a_stop_brings_the_arm_to_rest_and_is_recorded_until_then(loop):
    one = loop(RIG, PATH)
    one.when(Checked, lambda: one.orders.put(Follow(PATH)))
    one.when(Began, lambda: one.orders.put(Stop("enough")), after=1.0)
    assert one.run() == 1
    assert one.reported(Stopped) == [Stopped("enough", "stop")]
    places = np.array([row[3:6] for row in one.rows])
    # it moved a tick before the stop, and rests at the end
    assert np.linalg.norm(places[-20] - places[-21]) > 1e-5
    assert np.linalg.norm(places[-1] - places[-2]) < 1e-6


def test_a_source_that_pours_is_turned_back_before_the_arm_stops(loop):
    pour = pour_path(
        RIG, angular_velocity=1.5, distance=0.03, lip_height=0.2, final_angle=1.2, hold=5.0
    )
    ready = ready_to_pour(RIG, 0.03, 0.2)
    turned = np.flatnonzero(np.abs(pour.pose[:, 3:] - ready[3:]).max(axis=1) > 0.6)[0]
    one = loop(RIG, pour, "pouring")
    one.when(Checked, lambda: one.orders.put(Follow(pour)))
    one.when(Began, lambda: one.orders.put(Stop("enough")), after=float(pour.time[turned]))
    assert one.run() == 1
    assert one.reported(Stopped) == [Stopped("enough", "stop")]
    assert one.events("turning_back") and not one.events("not_turned_back")


# the same as processes, in real time


@pytest.fixture
def session(tmp_path):
    rig = emulated(RIG, PATH.pose[0])
    plan = [PATH, retract(RIG)]
    with Session(SessionSetup(RIG, tmp_path, rig.controller, armed=True, plan=plan)) as running:
        yield running


@pytest.mark.punctual
def test_a_session_moves_an_emulated_arm_and_asks_nobody(session):
    assert failures(session.preflight()) == ""
    for path in session.setup.plan:
        session.follow(path)
    assert session.wait(timeout=30.0)
    session.close()  # which waits until the arm rests
    last = (session.directory / SAMPLES).read_text().splitlines()[-1].split(",")
    there = session.setup.plan[-1].pose[-1, :3]
    assert np.array(last[3:6], float) == pytest.approx(there, abs=1e-3)


@pytest.mark.punctual
def test_an_emulated_arm_goes_with_its_process(session):
    session.preflight()
    session.follow(PATH)
    end = time.monotonic() + 10.0
    while not session.status().began and time.monotonic() < end:
        time.sleep(0.01)
    os.kill(session._processes.control.process.pid, signal.SIGKILL)
    with pytest.raises(SessionStopped, match="control process killed by SIGKILL"):
        session.wait(timeout=5.0)
