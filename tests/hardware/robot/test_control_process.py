import os
import signal
import time

import numpy as np
import pytest
from bolfi_liquids.hardware.board import SPAWN, Board, Row, Who, host_time
from bolfi_liquids.hardware.emulator.process import EmulatorProcess
from bolfi_liquids.hardware.motion.cup_frame import cup_frame
from bolfi_liquids.hardware.motion.kinematics import forward, inverse
from bolfi_liquids.hardware.motion.pour_paths import approach_pour, pour_path, ready_to_pour
from bolfi_liquids.hardware.motion.stir_paths import insert, stir
from bolfi_liquids.hardware.recorder.events import read_events
from bolfi_liquids.hardware.recorder.sample import Sample
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.robot.control_process import WATCHDOG, refused, run_control
from bolfi_liquids.hardware.robot.course import Course, Leg, Trail, advanced, queued
from bolfi_liquids.hardware.robot.inbox import Inbox, Vetting
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
from bolfi_liquids.hardware.robot.outlet import Outlet
from bolfi_liquids.hardware.safety.guards import Trip
from bolfi_liquids.hardware.safety.limits import workspace
from bolfi_liquids.hardware.safety.preflight import failures
from bolfi_liquids.hardware.session.patience import patient
from scipy.spatial.transform import Rotation

pytestmark = pytest.mark.punctual

RIG = patient(bundled_rig())
SHORT = {"rest": 0.1, "points": 5, "radius": 0.02}
QUICK = RIG.model_copy(update={"stirring": RIG.stirring.model_copy(update=SHORT)})
FRAME = cup_frame(RIG.cup)


def leg(number, length):
    path = insert(RIG)
    base = FRAME.to_base(path.pose[:length]) + number
    return Leg(number, path, base)


def play(course, ticks):
    told = []
    for _ in range(ticks):
        course, turn = advanced(course)
        told.append((course.hold[0], turn))
    return course, told


def test_paths_are_played_one_after_the_other_and_the_last_pose_is_held():
    start = Course(np.zeros(6))
    course = queued(queued(start, leg(1, 3)), leg(2, 2))
    course, told = play(course, 8)
    began = [(k, turn.began.number) for k, (_, turn) in enumerate(told) if turn.began]
    done = [(k, turn.done.number) for k, (_, turn) in enumerate(told) if turn.done]
    assert began == [(0, 1), (3, 2)]
    assert done == [(3, 1), (5, 2)]
    assert course.hold == pytest.approx(leg(2, 2).base[-1])
    assert course.leg is None and course.played == 5
    assert play(start, 3)[0] == start


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


def sample(index):
    return Sample._make([index, *np.linspace(0.1, 1.7, 19).tolist()])


def test_a_set_point_refused_after_a_stall_is_an_overrun():
    lost = "the connection to the controller is lost"
    assert refused(lost, True, 0.5 * WATCHDOG) == Trip("link", lost)
    assert refused(lost, False, 2.0 * WATCHDOG) == Trip("link", lost)
    assert refused(lost, True, 2.0 * WATCHDOG).reason.startswith("overrun: this computer sent")


def test_samples_are_handed_on_in_order_and_a_full_pipe_does_not_wait():
    reading, writing = SPAWN.Pipe(duplex=False)
    outlet = Outlet(writing)
    start = time.monotonic()
    for index in range(2000):
        outlet.put(sample(index))
    assert time.monotonic() - start < 1.0
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


def received(orders):
    """What an inbox makes of orders, the end of main among them."""
    mine, its = SPAWN.Pipe()
    inbox, items = Inbox(its), []
    for order in orders:
        mine.send(order)
    mine.close()
    inbox.start()
    end = time.monotonic() + 5.0
    while time.monotonic() < end and (not items or items[-1] != GONE):
        if (item := inbox.take()) is not None:
            items.append(item)
    return items


GONE = Trip("main", "the main process is gone")


def test_orders_come_in_their_order_and_the_end_of_main_is_a_reason_to_stop():
    orders = [Ask(), Stop("enough"), "go", Leave()]
    assert received(orders) == [
        Ask(),
        Trip("stop", "enough"),
        Trip("order", "an order was refused: 'go' is none"),
        Leave(),
        GONE,
    ]


def vetting():
    space = workspace(RIG, "stirring")
    first = FRAME.to_base(insert(RIG).pose[0])
    joints = inverse(space.arm, first, space.start, tcp=space.tcp).joints
    return Vetting(RIG, "stirring", first, joints)


def work(vetting, slices=1000):
    for _ in range(slices):
        if (item := vetting.work()) is not None:
            return item
    return None


def test_paths_that_continue_each_other_are_checked_in_slices():
    vet = vetting()
    for path in (insert(RIG), stir(QUICK)):
        vet.add(path)
    for number, path in enumerate((insert(RIG), stir(QUICK))):
        # a slice is far from the whole path
        assert work(vet, 3) is None and vet.busy
        leg = work(vet)
        assert isinstance(leg, Leg) and leg.number == number
        assert leg.base == pytest.approx(FRAME.to_base(path.pose))
    assert not vet.busy and vet.work() is None


NAN = insert(RIG)._replace(pose=insert(RIG).pose * np.nan)
ASIDE = insert(RIG)._replace(pose=insert(RIG).pose + [0.001, 0, 0, 0, 0, 0])
REFUSED = {
    "elsewhere": (stir(QUICK), "rad of a joint from the arm"),
    "a little aside": (ASIDE, "starts 1.000 mm, 0.00000 rad from the last set-point"),
    "NaN": (NAN, "not finite"),
    "no path": ("there", "refused"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_path_that_cannot_be_followed_is_a_reason_to_stop(name):
    path, words = REFUSED[name]
    vet = vetting()
    vet.add(path)
    item = work(vet)
    assert isinstance(item, Trip) and item.guard == "order" and words in item.reason, item


class Controlled:
    """A control process on an emulator, with a recorder that is only a row on the board."""

    def __init__(self, directory, rig, tool, start, armed):
        space = workspace(rig, tool)
        base = cup_frame(rig.cup).to_base(start)
        joints = inverse(space.arm, base, space.start, tcp=space.tcp).joints
        self.emulator = EmulatorProcess.start(joints=joints, options={"seed": 1})
        self.directory = directory
        self.board = Board()
        self.link, its = SPAWN.Pipe()
        self.samples, writing = SPAWN.Pipe(duplex=False)
        probes = base[None] if armed else np.empty((0, 6))
        to = Assignment(
            rig, self.emulator.address, tool, armed, str(directory), probes, cameras=False
        )
        self.process = SPAWN.Process(target=run_control, args=(to, self.board, its, writing))
        self.process.start()
        its.close()
        writing.close()
        self.rows: list[Sample] = []

    def wait_for(self, kind, timeout=15.0):
        """The next report of a kind; the recorder's row is kept fresh meanwhile."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            self.breathe()
            if self.link.poll():
                try:
                    report = self.link.recv()
                except EOFError:
                    raise AssertionError(f"ended early: {self.events('stopped')}") from None
                if isinstance(report, kind):
                    return report
        raise TimeoutError(kind.__name__)

    def breathe(self, seconds=0.01):
        end = time.monotonic() + seconds
        while True:
            self.board.write(Who.RECORDER, Row(host_time()))
            while self.samples.poll():
                try:
                    self.rows.extend(self.samples.recv())
                except EOFError:
                    return
            if time.monotonic() > end:
                return
            time.sleep(0.005)

    def events(self, kind):
        return [event for event in read_events(self.directory) if event["kind"] == kind]

    def close(self):
        self.link.close()
        self.process.join(3.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.samples.close()
        self.emulator.close()


@pytest.fixture
def controlled(tmp_path):
    pytest.importorskip("rtde_control")
    running = []

    def start(rig=QUICK, tool="stirring", pose=None, armed=True):
        pose = stir(rig).pose[0] if pose is None else pose
        running.append(Controlled(tmp_path, rig, tool, pose, armed))
        return running[-1]

    yield start
    for one in running:
        one.close()


def test_a_path_is_followed_recorded_and_logged(controlled):
    control = controlled()
    checked = control.wait_for(Checked)
    assert failures(checked.checks) == ""
    assert {check.name for check in checked.checks} >= {
        *("connection", "robot mode", "safety", "program", "box", "payload", "tool's centre"),
        *("force at rest", "recorder", "disk", "controller's limits", "kinematics"),
    }
    path = stir(QUICK)
    control.link.send(Follow(path))
    began = control.wait_for(Began)
    control.link.send(Ask())
    readings = control.wait_for(Told).readings
    assert len(readings) > 10 and all(reading.green for reading in readings)
    done = control.wait_for(Done)
    assert done.robot_time - began.robot_time == pytest.approx(path.duration, abs=0.5)
    control.link.send(Leave())
    control.wait_for(Left)
    control.process.join(2.0)
    assert control.process.exitcode == 0
    control.breathe(0.05)
    assert [row.index for row in control.rows] == list(range(len(control.rows)))
    # what was recorded is the star, with the servo's lag
    stirred = np.array([row[3:6] for row in control.rows if row.stirring])
    away = [np.linalg.norm(path.pose[:, :3] - place, axis=1).min() for place in stirred[::20]]
    assert max(away) < 0.003
    assert np.ptp(stirred[:, 0]) == pytest.approx(np.ptp(path.pose[:, 0]), abs=0.003)
    (event,) = control.events("began")
    assert event["hash"] == fingerprint(path) and event["stirring"]
    assert control.events("done") and not control.events("stopped")


def begin_stir(control):
    control.wait_for(Checked)
    control.link.send(Follow(stir(QUICK)))
    control.wait_for(Began)
    control.breathe(1.0)
    assert not control.emulator.admin.state().at_rest


def stops(control):
    stopped = control.wait_for(Stopped)
    control.process.join(3.0)
    assert control.process.exitcode == 1
    assert control.emulator.admin.state().at_rest
    assert control.emulator.admin.state().runtime_state == 1
    (event,) = control.events("stopped")
    assert event["reason"] == stopped.reason and event["guard"] == stopped.guard
    return stopped


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_a_signal_stops_the_arm(controlled, number):
    control = controlled()
    begin_stir(control)
    os.kill(control.process.pid, number)
    assert number.name in stops(control).reason


@pytest.mark.slow
def test_late_packages_stop_the_arm(controlled):
    control = controlled()
    begin_stir(control)
    control.emulator.admin.late(1.0)
    assert stops(control).guard in ("silence", "delay")


@pytest.mark.slow
def test_a_silent_recorder_stops_the_arm(controlled):
    control = controlled()
    begin_stir(control)
    time.sleep(0.6)
    assert stops(control).guard == "recorder"


@pytest.mark.slow
def test_leaving_during_a_motion_is_a_stop(controlled):
    control = controlled()
    begin_stir(control)
    control.link.send(Leave())
    assert "leave" in stops(control).reason


def test_a_dry_run_looks_and_refuses_to_move(controlled):
    control = controlled(armed=False)
    checked = control.wait_for(Checked)
    # the controller's own tool differs from the rig's file, which the look tells
    assert "kinematics" in failures(checked.checks)
    control.process.join(2.0)
    assert control.emulator.admin.motions() == 0
    assert control.emulator.admin.state().runtime_state == 1


def test_an_arm_outside_its_box_is_not_armed(controlled):
    high = stir(QUICK).pose[0] + [0, 0, 0.25, 0, 0, 0]
    control = controlled(pose=high)
    checked = control.wait_for(Checked)
    assert "box: the tool is at" in failures(checked.checks)
    assert control.events("refused") and checked.pose is None
    control.process.join(2.0)
    assert control.emulator.admin.motions() == 0


@pytest.mark.slow
def test_a_source_that_pours_is_turned_back_before_the_arm_stops(controlled):
    pour = pour_path(
        RIG, angular_velocity=1.5, distance=0.03, lip_height=0.2, final_angle=1.2, hold=5.0
    )
    ready = ready_to_pour(RIG, 0.03, 0.2)
    control = controlled(RIG, "pouring", ready)
    checked = control.wait_for(Checked)
    assert failures(checked.checks) == ""
    control.link.send(Follow(pour))
    control.wait_for(Began)
    turned = np.flatnonzero(np.abs(pour.pose[:, 3:] - ready[3:]).max(axis=1) > 0.6)[0]
    control.breathe(pour.time[turned])
    control.link.send(Stop("enough"))
    stopped = control.wait_for(Stopped)
    assert stopped == Stopped("enough", "stop")
    control.process.join(3.0)
    space = workspace(RIG, "pouring")
    upright = forward(space.arm, control.emulator.admin.state().joints, tcp=space.tcp)
    assert upright[3:] == pytest.approx(RIG.robot.pouring_orientation, abs=0.1)
    assert control.events("turning_back")


@pytest.mark.slow
def test_a_source_is_not_turned_back_on_a_force(controlled):
    pour = pour_path(
        RIG, angular_velocity=1.5, distance=0.03, lip_height=0.2, final_angle=1.2, hold=5.0
    )
    control = controlled(RIG, "pouring", ready_to_pour(RIG, 0.03, 0.2))
    control.wait_for(Checked)
    control.link.send(Follow(pour))
    control.wait_for(Began)
    control.breathe(3.5)
    control.emulator.admin.force([30.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert control.wait_for(Stopped).guard == "force"
    control.process.join(3.0)
    assert not control.events("turning_back")


@pytest.mark.slow
def test_a_source_that_came_tilted_is_not_turned_back_to_that(controlled):
    """A way there that is given up leads back to wherever the arm was jogged to."""
    ready = ready_to_pour(RIG, 0.03, 0.2)
    turned = Rotation.from_rotvec([0.0, 0.4, 0.0]) * Rotation.from_rotvec(ready[3:])
    start = np.array([*ready[:3] + [0.0, 0.0, 0.03], *turned.as_rotvec()])
    control = controlled(RIG, "pouring", start)
    checked = control.wait_for(Checked)
    assert failures(checked.checks) == ""
    path = approach_pour(RIG, FRAME.from_base(checked.pose), distance=0.03, lip_height=0.2)
    control.link.send(Follow(path))
    control.wait_for(Began)
    control.breathe(0.9 * path.duration)
    control.link.send(Stop("enough"))
    assert control.wait_for(Stopped) == Stopped("enough", "stop")
    assert not control.events("turning_back")
