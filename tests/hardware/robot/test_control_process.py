import os
import signal
import time

import numpy as np
import pytest
from bolfi_liquids.hardware.board import SPAWN, Board, Row, Who, host_time
from bolfi_liquids.hardware.motion.kinematics import forward, inverse
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.pour_paths import approach_pour, pour_path, ready_to_pour
from bolfi_liquids.hardware.motion.stir_paths import insert, stir
from bolfi_liquids.hardware.recorder.events import read_events
from bolfi_liquids.hardware.recorder.samples import Sample
from bolfi_liquids.hardware.rig_file import bundled_rig
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
from bolfi_liquids.hardware.robot.ur import URController
from bolfi_liquids.hardware.safety.guards import Trip
from bolfi_liquids.hardware.safety.limits import workspace
from bolfi_liquids.hardware.safety.preflight import failures
from scipy.spatial.transform import Rotation
from short_rig import short_rig
from ur_controller.patience import patient
from ur_controller.process import ControllerProcess

RIG = patient(bundled_rig())
QUICK = patient(short_rig())
PERIOD = 1.0 / RIG.robot.rate
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
    assert course.leg is None
    held = [*leg(1, 3).base, *leg(2, 2).base]
    assert [x for x, _ in told[:5]] == [pose[0] for pose in held]
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
    assert refused(lost, True, 0.5 * WATCHDOG_PERIOD) == Trip("link", lost)
    assert refused(lost, False, 2.0 * WATCHDOG_PERIOD) == Trip("link", lost)
    assert refused(lost, True, 2.0 * WATCHDOG_PERIOD).reason.startswith(
        "overrun: this computer sent"
    )


def test_samples_are_handed_on_in_order_and_a_full_pipe_does_not_wait():
    reading, writing = SPAWN.Pipe(duplex=False)
    outlet = Outlet(writing)
    start = time.monotonic()
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
    joints = inverse(space.arm, first, space.start, tcp=space.tcp)
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

    def __init__(self, directory):
        space = workspace(QUICK, "stirring")
        base = FRAME.to_base(stir(QUICK).pose[0])
        joints = inverse(space.arm, base, space.start, tcp=space.tcp)
        self.emulator = ControllerProcess.start(joints=joints, options={"seed": 1})
        self.directory = directory
        self.board = Board()
        self.link, its = SPAWN.Pipe()
        self.samples, writing = SPAWN.Pipe(duplex=False)
        controller, where = URController(self.emulator.address), str(directory)
        to = Assignment(QUICK, controller, "stirring", True, where, base[None], cameras=False)
        self.process = SPAWN.Process(target=run_control, args=(to, self.board, its, writing))
        self.process.start()
        its.close()
        writing.close()

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
                    self.samples.recv()
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
    """A real control process, on a real emulator."""
    pytest.importorskip("rtde_control")
    running = Controlled(tmp_path)
    yield running
    running.close()


@pytest.mark.punctual  # what a signal does to a process, and to the arm that it moves
@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.minutes)]
)
def test_a_signal_stops_the_arm(controlled, number):
    controlled.wait_for(Checked)
    controlled.link.send(Follow(stir(QUICK)))
    controlled.wait_for(Began)
    controlled.breathe(1.0)
    assert not controlled.emulator.admin.state().at_rest
    os.kill(controlled.process.pid, number)
    stopped = controlled.wait_for(Stopped)
    assert number.name in stopped.reason
    controlled.process.join(3.0)
    assert controlled.process.exitcode == 1
    assert controlled.emulator.admin.state().at_rest
    assert controlled.emulator.admin.state().runtime_state == 1
    (event,) = controlled.events("stopped")
    assert event["reason"] == stopped.reason and event["guard"] == stopped.guard


@pytest.fixture
def control(stepped):
    """The same in this thread, on a clock that is stepped."""

    def start(rig=QUICK, tool="stirring", pose=None, **options):
        return stepped(rig, tool, stir(rig).pose[0] if pose is None else pose, **options)

    return start


def test_a_path_is_followed_recorded_and_logged(control):
    one, path = control(), stir(QUICK)
    one.when(Checked, lambda: one.orders.put(Follow(path)))
    one.when(Began, lambda: one.orders.put(Ask()), after=1.0)
    one.when(Done, lambda: one.orders.put(Leave()))
    assert one.run() == 0
    kinds = [type(report) for report in one.reports]
    assert kinds == [Checked, Began, Told, Done, Left]
    checked, began, told, done, _ = one.reports
    assert failures(checked.checks) == ""
    assert {check.name for check in checked.checks} >= {
        *("connection", "robot mode", "safety", "program", "box", "payload", "tool's centre"),
        *("force at rest", "recorder", "disk", "controller's limits", "kinematics"),
    }
    assert len(told.readings) > 10 and all(reading.green for reading in told.readings)
    assert done.robot_time - began.robot_time == pytest.approx(path.duration, abs=2.5 * PERIOD)
    assert [row.index for row in one.rows] == list(range(len(one.rows)))
    # a package for each tick: one is missed while the loop finds its place between two of them
    steps = np.diff([row.time for row in one.rows if row.stirring]) / PERIOD
    assert sorted(np.round(steps, 6))[:-1] == [1.0] * (len(steps) - 1) and max(steps) < 2.1
    # what was recorded is the star, with the servo's lag
    stirred = np.array([row[3:6] for row in one.rows if row.stirring])
    away = [np.linalg.norm(path.pose[:, :3] - place, axis=1).min() for place in stirred[::20]]
    assert max(away) < 0.003
    assert np.ptp(stirred[:, 0]) == pytest.approx(np.ptp(path.pose[:, 0]), abs=0.003)
    (event,) = one.events("began")
    assert event["hash"] == fingerprint(path) and event["stirring"]
    assert one.events("done") and not one.events("stopped")


def test_a_dry_run_looks_and_refuses_to_move(control):
    one = control(armed=False)
    assert one.run() == 1
    # the controller's own tool differs from the rig's file, which the look tells
    (checked,) = one.reports
    assert "kinematics" in failures(checked.checks)
    assert one.emulator.controller.started == 0
    assert one.emulator.controller.snapshot.runtime_state == 1


def test_an_arm_outside_its_box_is_not_armed(control):
    one = control(pose=stir(QUICK).pose[0] + [0, 0, 0.25, 0, 0, 0])
    assert one.run() == 1
    (checked,) = one.reports
    assert "box: the tool is at" in failures(checked.checks)
    assert one.events("refused") and checked.pose is None
    assert one.emulator.controller.started == 0


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
    assert one.events("turning_back")


def test_a_source_is_not_turned_back_on_a_force(control):
    one = control(RIG, "pouring", READY)
    push = one.emulator.controller.force.press
    stopped, _ = one.stopped_by(lambda: push((30.0, 0.0, 0.0, 0.0, 0.0, 0.0)), Follow(POUR), 3.5)
    assert stopped.guard == "force"
    assert not one.events("turning_back")


def test_a_source_that_came_tilted_is_not_turned_back_to_that(control):
    """A way there that is given up leads back to wherever the arm was jogged to."""
    turned = Rotation.from_rotvec([0.0, 0.4, 0.0]) * Rotation.from_rotvec(READY[3:])
    start = np.array([*READY[:3] + [0.0, 0.0, 0.03], *turned.as_rotvec()])
    one = control(RIG, "pouring", start)
    path = approach_pour(RIG, start, distance=0.03, lip_height=0.2)
    stopped, _ = one.stopped_by(
        lambda: one.orders.put(Stop("enough")), Follow(path), 0.9 * path.duration
    )
    assert stopped == Stopped("enough", "stop")
    assert not one.events("turning_back")
