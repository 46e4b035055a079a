"""The control process: its queues, its motion loop on a stepped clock, and faults during a motion.

The loop moves the emulated arm, or `URArm` by an emulated controller in this thread. `test_faults`
has the faults that kill or stop whole processes, with the real client and in real time.
"""

import os
import signal
import time

import numpy as np
import pytest
from bolfi_liquids.hardware import emulated
from bolfi_liquids.hardware.board import SPAWN, Board, Row, Trouble, Who, host_time
from bolfi_liquids.hardware.emulated.rig import patient as rehearsed
from bolfi_liquids.hardware.motion.kinematics import forward, inverse
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.pour_paths import approach_pour, pour_path, ready_to_pour
from bolfi_liquids.hardware.motion.stir_paths import insert, stir
from bolfi_liquids.hardware.recorder.events import read_events
from bolfi_liquids.hardware.recorder.samples import Sample
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.robot import ur
from bolfi_liquids.hardware.robot.control_loop import WATCHDOG_PERIOD, refused, run_control
from bolfi_liquids.hardware.robot.orders import (
    Ask,
    Assignment,
    Began,
    Checked,
    Done,
    Follow,
    Leave,
    Left,
    Stop,
    Stopped,
    Told,
    fingerprint,
)
from bolfi_liquids.hardware.robot.queues import (
    Course,
    Inbox,
    Leg,
    Outlet,
    Trail,
    Vetting,
    advanced,
    queued,
)
from bolfi_liquids.hardware.safety.guards import Trip
from bolfi_liquids.hardware.safety.limits import workspace
from bolfi_liquids.hardware.safety.preflight import failures
from scipy.spatial.transform import Rotation
from short_rig import short_rig
from stepped_clock import SteppedClock
from ur_controller.patience import patient
from ur_controller.process import ControllerProcess

RIG = bundled_rig()
QUICK = short_rig()
PATH = stir(QUICK)
PERIOD = 1.0 / RIG.robot.rate
FRAME = cup_frame(RIG.cup)


# -- queues


def leg(number, length):
    path = insert(RIG)
    return Leg(number, path, FRAME.to_base(path.pose[:length]) + number)


def play(course, ticks):
    told = []
    for _ in range(ticks):
        course, turn = advanced(course)
        told.append((course.hold[2], turn))
    return course, told


def test_paths_are_played_one_after_the_other_and_the_last_pose_is_held():
    start = Course(np.zeros(6))
    course, told = play(queued(queued(start, leg(1, 3)), leg(2, 2)), 8)
    began = [(k, turn.began.number) for k, (_, turn) in enumerate(told) if turn.began]
    done = [(k, turn.done.number) for k, (_, turn) in enumerate(told) if turn.done]
    assert began == [(0, 1), (3, 2)] and done == [(3, 1), (5, 2)]
    assert course.hold == pytest.approx(leg(2, 2).base[-1]) and course.leg is None
    held = [*leg(1, 3).base, *leg(2, 2).base]
    assert [z for z, _ in told[:5]] == [pose[2] for pose in held]
    assert play(start, 3)[0] == start
    # joined paths keep their time: what is commanded already is not commanded again
    base = leg(1, 3).base
    _, told = play(queued(Course(base[0]), leg(1, 3)), 2)
    assert [z for z, _ in told] == [pose[2] for pose in base[1:]] and base[0, 2] != base[1, 2]


def test_the_trail_measures_the_distance_from_the_nearest_recent_set_point():
    pose = np.array([0.1, 0.2, 0.3, np.pi, 0.0, 0.0])
    trail = Trail(pose, 5)
    trail.put(pose + [0.01, 0, 0, 0, 0, 0])
    away, turn = trail.error(np.array([0.11, 0.203, 0.3, -np.pi, 0.0, 0.0]))
    assert away == pytest.approx(0.003) and turn < 1e-6
    # by and by the old ones are forgotten
    for _ in range(5):
        trail.put(pose + [0.02, 0, 0, 0, 0, 0])
    assert trail.error(pose)[0] == pytest.approx(0.02)
    assert trail.error(pose + [0.02, 0, 0, -0.1, 0, 0])[1] == pytest.approx(0.1)


def test_a_set_point_refused_after_a_stall_is_an_overrun():
    lost = "the connection to the controller is lost"
    assert refused(lost, True, 0.5 * WATCHDOG_PERIOD) == Trip("link", lost)
    assert refused(lost, False, 2.0 * WATCHDOG_PERIOD) == Trip("link", lost)
    assert refused(lost, True, 2.0 * WATCHDOG_PERIOD).guard == "overrun"


def test_samples_are_handed_on_in_order_and_a_full_pipe_does_not_wait():
    def sample(index):
        return Sample._make([index, *np.linspace(0.1, 1.7, 19).tolist()])

    reading, writing = SPAWN.Pipe(duplex=False)
    outlet, start = Outlet(writing), time.monotonic()
    for index in range(2000):
        outlet.put(sample(index))
    assert time.monotonic() - start < 10.0  # 2000 waits of 5 ms
    assert 0 < outlet.waiting < 2000 and not outlet.gone
    taken = []
    while outlet.waiting or reading.poll():
        taken.extend(one.index for one in reading.recv())
        outlet.flush()
    assert taken == list(range(2000))
    reading.close()
    for index in range(5):
        outlet.put(sample(index))
    assert outlet.gone
    writing.close()


def test_orders_come_in_their_order_and_the_end_of_main_is_a_reason_to_stop(monkeypatch):
    monkeypatch.setattr("bolfi_liquids.hardware.robot.queues.hurry", lambda: "normal")
    mine, its = SPAWN.Pipe()
    inbox, items, end = Inbox(its), [], time.monotonic() + 5.0
    for order in (Ask(), Stop("enough"), "go", Leave()):
        mine.send(order)
    mine.close()
    inbox.start()
    while time.monotonic() < end and len(items) < 5:
        if (item := inbox.take()) is not None:
            items.append(item)
    ask, stop, wrong, leave, gone = items
    assert (ask, stop, leave) == (Ask(), Trip("stop", "enough"), Leave())
    assert (wrong.guard, gone.guard) == ("order", "main") and "'go'" in wrong.reason


def vetting():
    space = workspace(RIG, "stirring")
    first = FRAME.to_base(insert(RIG).pose[0])
    joints = inverse(space.arm, first, space.start, tcp=space.tcp)
    return Vetting(RIG, "stirring", first, joints)


def work(vetting, slices=1000):
    for _ in range(slices):
        if (item := vetting.work()) is not None:
            return item
    return None


def test_paths_that_continue_each_other_are_checked_in_slices():
    vet = vetting()
    for path in (insert(RIG), PATH):
        vet.add(path)
    for number, path in enumerate((insert(RIG), PATH)):
        # a slice is far from the whole path
        assert work(vet, 3) is None and vet.busy
        leg = work(vet)
        assert isinstance(leg, Leg) and leg.number == number
        assert leg.base == pytest.approx(FRAME.to_base(path.pose))
    assert not vet.busy and vet.work() is None


def test_a_path_that_cannot_be_followed_is_a_reason_to_stop():
    down = insert(RIG)
    for path, words in (
        (PATH, "rad of a joint from the arm"),
        (down._replace(pose=down.pose + [0.001, 0, 0, 0, 0, 0]), "starts 1.000 mm"),
        (down._replace(pose=down.pose * np.nan), "not finite"),
        ("there", "refused"),
    ):
        vet = vetting()
        vet.add(path)
        item = work(vet)
        assert isinstance(item, Trip) and item.guard == "order" and words in item.reason, item


# -- the loop, on a stepped clock


@pytest.fixture
def control(stepped):
    """Makes the control process of a UR arm that rests where a stir begins."""

    def start(rig=QUICK, tool="stirring", pose=None, **options):
        return stepped(rig, tool, stir(rig).pose[0] if pose is None else pose, **options)

    return start


@pytest.fixture
def rehearsal(stepped_loop, tmp_path):
    """The same of the emulated arm."""

    def start(rig=QUICK):
        controller = emulated(rig, PATH.pose[0]).controller
        clock = SteppedClock(controller.begun)
        arm, probes = controller._replace(clock=clock), FRAME.to_base(PATH.pose[:1])
        to = Assignment(rig, arm, "stirring", True, str(tmp_path), probes, cameras=False)
        return stepped_loop(to, clock)

    return start


@pytest.mark.parametrize("arm", ["control", "rehearsal"])
def test_a_path_is_followed_recorded_and_logged(request, arm):
    one = request.getfixturevalue(arm)()
    one.when(Checked, lambda: one.orders.put(Follow(PATH)))
    one.when(Began, lambda: one.orders.put(Ask()), after=1.0)
    one.when(Done, lambda: one.orders.put(Leave()))
    assert one.run() == 0
    assert [type(report) for report in one.reports] == [Checked, Began, Told, Done, Left]
    checked, began, told, done, _ = one.reports
    assert failures(checked.checks) == ""
    assert {check.name for check in checked.checks} >= {
        *("connection", "robot mode", "safety", "program", "box", "payload", "tool's centre"),
        *("force at rest", "recorder", "disk", "kinematics", "speed slider", "at rest"),
        "controller's limits",
    }
    assert len(told.readings) > 10 and all(reading.green for reading in told.readings)
    assert done.robot_time - began.robot_time == pytest.approx(PATH.duration, abs=2.5 * PERIOD)
    assert [row.index for row in one.rows] == list(range(len(one.rows)))
    # a package for each tick: one is missed while the loop finds its place between two of them
    steps = np.diff([row.time for row in one.rows if row.stirring]) / PERIOD
    assert sorted(np.round(steps, 6))[:-1] == [1.0] * (len(steps) - 1) and max(steps) < 2.1
    # what was recorded is the star, with the servo's lag
    stirred = np.array([row[3:6] for row in one.rows if row.stirring])
    away = [np.linalg.norm(PATH.pose[:, :3] - place, axis=1).min() for place in stirred[::20]]
    assert max(away) < 0.003
    assert np.ptp(stirred[:, 0]) == pytest.approx(np.ptp(PATH.pose[:, 0]), abs=0.003)
    (event,) = one.events("began")
    assert event["hash"] == fingerprint(PATH) and event["stirring"]
    assert one.events("done") and not one.events("stopped")


def test_a_session_on_the_stepped_clock_is_the_same_each_time(control):
    runs = []
    for _ in range(2):
        one = control()
        one.when(Checked, lambda one=one: one.orders.put(Follow(PATH)))
        one.when(Began, lambda one=one: one.orders.put(Stop("enough")), after=0.5)
        one.run()
        runs.append(str(one.rows))
    assert runs[0] == runs[1]


def test_a_dry_run_looks_and_refuses_to_move(control):
    one = control(armed=False)
    assert one.run() == 1
    # the controller's own tool differs from the rig's file, which the look tells
    (checked,) = one.reports
    assert "kinematics" in failures(checked.checks)
    assert one.emulator.controller.started == 0
    assert one.emulator.controller.snapshot.runtime_state == 1


def test_an_arm_outside_its_box_is_not_armed(control):
    one = control(pose=PATH.pose[0] + [0, 0, 0.25, 0, 0, 0])
    assert one.run() == 1
    (checked,) = one.reports
    assert "box: the tool is at" in failures(checked.checks)
    assert one.events("refused") and checked.pose is None
    assert one.emulator.controller.started == 0


def test_a_plan_with_a_pose_that_the_controller_does_not_allow_is_not_armed(control):
    far = np.array([3.0, 0.0, 0.2, np.pi, 0.0, 0.0])
    one = control(plan=[far])
    assert one.run() == 1
    (checked,) = one.reports
    told = failures(checked.checks)
    assert told == "controller's limits: 1 of 2 poses of the plan are within them"
    assert one.events("refused")
    # its program ends, and has moved nothing
    one.clock.sleep(1.0)
    assert one.emulator.controller.snapshot.runtime_state == 1
    assert not one.moved


def changed(**change):
    pose = PATH.pose.copy()
    pose[change["at"]] = change["to"]
    return PATH._replace(pose=pose)


PUSH = (30.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NAN_PATH = changed(at=(3, 1), to=np.nan)
OUTSIDE = changed(at=(slice(None), 0), to=0.2)
# what happens during a motion, the time in which the arm must rest [s], the guard
FAULTS = {
    "late packages": (lambda one: setattr(one.emulator, "late", 1.0), 0.3, "silence"),
    "a frozen link": (lambda one: one.emulator.freeze(10.0), 0.3, "silence"),
    "a dropped link": (lambda one: one.emulator.drop(), 0.3, "link"),
    "a silent recorder": (lambda one: one.silent.add(Who.RECORDER), 0.6, "recorder"),
    "a dead recorder": (lambda one: one.recorder.close(), 0.3, "recorder pipe"),
    "a full disk": (
        lambda one: one.trouble.update({Who.RECORDER: Trouble.WRITE_FAILED}),
        0.3,
        "recorder health",
    ),
    "a silent camera": (lambda one: one.silent.add(Who.CAMERA_XZ), 0.5, "camera xz"),
    "a frozen camera": (
        lambda one: one.trouble.update({Who.CAMERA_YZ: Trouble.SAME_PICTURE}),
        0.3,
        "camera yz health",
    ),
    "a force": (lambda one: setattr(one.emulator.controller, "pressed", PUSH), 0.3, "force"),
    "a protective stop": (
        lambda one: one.emulator.controller.protective_stop("by the test"),
        0.3,
        "safety",
    ),
    "a stall": (lambda one: one.clock.sleep(0.3), 0.3, "overrun"),
    "a short stall": (lambda one: one.clock.sleep(0.06), 0.3, "overrun"),
    "an order of NaN": (lambda one: one.orders.put(Follow(NAN_PATH)), 0.3, "order"),
    "an order outside": (lambda one: one.orders.put(Follow(OUTSIDE)), 0.3, "order"),
    "leaving": (lambda one: one.orders.put(Leave()), 0.3, "stop"),
    "a signal": (lambda one: one.links.signals.append("SIGHUP"), 0.3, "stop"),
    # nothing is to be noticed first: all of it is the brake's time
    "main's stop": (lambda one: one.orders.put(Stop("enough")), 0.05, "stop"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_stops_the_arm_for_good_and_says_why(control, name):
    act, bar, guard = FAULTS[name]
    one = control(cameras=True)
    stopped, lasted = one.stopped_by(lambda: act(one), Follow(PATH), 1.0)
    assert stopped.guard == guard and stopped.reason
    assert lasted < bar
    # samples go on until the arm rests, as far as the link lets them through
    assert [row.index for row in one.rows] == list(range(len(one.rows)))


@pytest.mark.parametrize("deceleration", [ur.STOP_DECELERATION, 1.0])
def test_the_arm_brakes_as_its_driver_asks(control, monkeypatch, deceleration):
    monkeypatch.setattr(ur, "STOP_DECELERATION", deceleration)
    one, speeds = control(cameras=True), []

    def stop():
        speeds.append(np.linalg.norm(one.emulator.controller.arm.velocity[:3]))
        one.orders.put(Stop("enough"))

    _, lasted = one.stopped_by(stop, Follow(PATH), 0.9)
    (speed,) = speeds
    assert speed == pytest.approx(QUICK.stirring.speed, rel=0.05)
    assert speed / deceleration < lasted < speed / deceleration + 2 * PERIOD


@pytest.mark.parametrize("stall", [0.06, 0.9])
def test_a_rehearsal_bears_a_stall_and_the_rig_s_own_limits_bear_none(rehearsal, stall):
    for rig, code in ((rehearsed(QUICK), 0), (QUICK, 1)):
        one = rehearsal(rig)
        one.when(Checked, lambda one=one: one.orders.put(Follow(PATH)))
        one.when(Began, lambda one=one: one.clock.sleep(stall), after=1.0)
        one.when(Done, lambda one=one: one.orders.put(Leave()))
        assert one.run() == code
        if code == 0:
            began, done = one.reported(Began)[0], one.reported(Done)[0]
            # the path is delayed, and not hurried
            late = done.robot_time - began.robot_time - PATH.duration
            assert late == pytest.approx(stall, abs=4 * PERIOD)
        else:
            assert one.reported(Stopped)[0].guard == "overrun"


def test_a_patient_rig_bears_a_frozen_link(control):
    """The twin of the test above: what trips there is the limits, not the stepped clock."""
    one = control(patient(QUICK))
    one.when(Checked, lambda: one.orders.put(Follow(PATH)))
    one.when(Began, lambda: one.emulator.freeze(0.06), after=1.0)
    one.when(Done, lambda: one.orders.put(Leave()))
    assert one.run() == 0


POUR = pour_path(
    RIG, angular_velocity=1.5, distance=0.03, lip_height=0.2, final_angle=1.2, hold=5.0
)
READY = ready_to_pour(RIG, 0.03, 0.2)


def test_a_source_that_pours_is_turned_back_before_the_arm_stops(control):
    one = control(RIG, "pouring", READY)
    turned = np.flatnonzero(np.abs(POUR.pose[:, 3:] - READY[3:]).max(axis=1) > 0.6)[0]
    stopped, _ = one.stopped_by(
        lambda: one.orders.put(Stop("enough")), Follow(POUR), POUR.time[turned]
    )
    assert stopped == Stopped("enough", "stop")
    space = workspace(RIG, "pouring")
    upright = forward(space.arm, one.emulator.controller.snapshot.joints, tcp=space.tcp)
    assert upright[3:] == pytest.approx(RIG.robot.pouring_orientation, abs=0.1)
    assert one.events("turning_back") and not one.events("not_turned_back")


def test_a_source_is_not_turned_back_on_a_force(control):
    one = control(RIG, "pouring", READY)
    machine = one.emulator.controller
    stopped, _ = one.stopped_by(lambda: setattr(machine, "pressed", PUSH), Follow(POUR), 3.5)
    assert stopped.guard == "force"
    assert not one.events("turning_back")


def test_a_source_that_came_tilted_is_not_turned_back_to_that(control):
    """A way there that is given up leads back to wherever the arm was jogged to."""
    turned = Rotation.from_rotvec([0.0, 0.4, 0.0]) * Rotation.from_rotvec(READY[3:])
    start = np.array([*READY[:3] + [0.0, 0.0, 0.03], *turned.as_rotvec()])
    path = approach_pour(RIG, start, distance=0.03, lip_height=0.2)
    one, late = control(RIG, "pouring", start), 0.9 * path.duration
    stopped, _ = one.stopped_by(lambda: one.orders.put(Stop("enough")), Follow(path), late)
    assert stopped == Stopped("enough", "stop")
    assert not one.events("turning_back")


# -- a real control process, on a real emulator


@pytest.mark.punctual  # what a signal does to a process, and to the arm that it moves
@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.minutes)]
)
def test_a_signal_stops_the_arm(tmp_path, number):
    pytest.importorskip("rtde_control")
    rig, board, start = patient(QUICK), Board(), FRAME.to_base(PATH.pose[0])
    link, its = SPAWN.Pipe()
    samples, writing = SPAWN.Pipe(duplex=False)

    def wait_for(kind, timeout=15.0):
        """The next report of a kind; the recorder's row is kept fresh meanwhile."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            board.write(Who.RECORDER, Row(host_time()))
            while samples.poll():
                samples.recv()
            if link.poll(0.005) and isinstance(report := link.recv(), kind):
                return report
        return None

    with ControllerProcess.at_pose(rig, PATH.pose[0]) as emulator:
        controller, where = ur.URController(emulator.address), str(tmp_path)
        to = Assignment(rig, controller, "stirring", True, where, start[None], cameras=False)
        process = SPAWN.Process(target=run_control, args=(to, board, its, writing))
        process.start()
        its.close()
        writing.close()
        try:
            assert wait_for(Checked)
            link.send(Follow(PATH))
            assert wait_for(Began)
            assert wait_for(Done, timeout=1.0) is None  # it moves meanwhile
            assert not emulator.admin.state().resting
            os.kill(process.pid, number)
            stopped = wait_for(Stopped)
            process.join(3.0)
            assert process.exitcode == 1
            assert number.name in stopped.reason
            state = emulator.admin.state()
            assert state.resting and state.runtime_state == 1
        finally:
            process.kill()
            process.join()
    (event,) = (one for one in read_events(tmp_path) if one["kind"] == "stopped")
    assert (event["reason"], event["guard"]) == (stopped.reason, stopped.guard)
