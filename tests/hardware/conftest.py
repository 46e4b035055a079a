"""The motion loop, its driver and a controller in this thread, on a clock that the test steps."""

import sys
from collections.abc import Callable
from pathlib import Path
from queue import Queue

import numpy as np
import pytest
from bolfi_liquids.hardware.arm import Tool
from bolfi_liquids.hardware.board import SPAWN, Board, Row, Who
from bolfi_liquids.hardware.motion.kinematics import inverse
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.recorder.events import EventLog, read_events
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.robot import control_loop, queues, ur
from bolfi_liquids.hardware.robot.control_loop import ControlLoop, Links, checked
from bolfi_liquids.hardware.robot.orders import (
    Assignment,
    Began,
    Checked,
    Follow,
    Order,
    Report,
    Stopped,
)
from bolfi_liquids.hardware.safety.limits import workspace

sys.path.insert(0, str(Path(__file__).parent))
from stepped_clock import SteppedClock  # noqa: E402
from ur_controller.machine import Options  # noqa: E402
from ur_controller.stepped import AtOnce, SteppedController, library  # noqa: E402

LONGEST = 120.0  # s of the stepped clock, after which a test has failed


class Orders:
    """The loop's end of its pipe to main; an order has arrived once `put` has returned."""

    def __init__(self, told: Callable[[Report], None]):
        self.send = told
        self._queue: Queue[Order | type[EOFError]] = Queue()
        self._taken = False

    def put(self, order: Order) -> None:
        self._queue.put(order)
        self._queue.join()

    def recv(self) -> Order:
        # whoever asks for the next one has put the last one down
        if self._taken:
            self._queue.task_done()
        self._taken = True
        order = self._queue.get()
        if order is EOFError:
            raise EOFError
        return order

    def close(self) -> None:
        self._queue.put(EOFError)


class SteppedControl:
    """What the control process does, with signs of life of the others, on a stepped clock.

    Attributes:
        reports: What main is told.
        recorder: Its end of the pipe for samples.
        rows: Samples that it was given.
        silent: Others that give no more signs of life.
        trouble: What the others complain of.
        moved: Host times of ticks in which the arm moved [s].
    """

    def __init__(self, to: Assignment, clock: SteppedClock, emulator: SteppedController | None):
        self.emulator, self.clock = emulator, clock
        self.directory = Path(to.directory)
        self.reports: list[Report] = []
        self.rows, self.silent, self.trouble, self.moved = [], set(), {}, []
        self._to = to
        self._reactions: list[tuple[type, float, Callable[[], object]]] = []
        self.orders = Orders(self._told)
        self.recorder, writing = SPAWN.Pipe(duplex=False)
        log = EventLog(self.directory, "control")
        self.links = Links(Board(), self.orders, writing, log, [])

    def when(self, kind: type, act: Callable[[], object], after: float = 0.0) -> None:
        """Do something so long [s] after the first report of a kind."""
        self._reactions.append((kind, after, act))

    def run(self) -> int:
        """The control process from its start to its end; its exit code."""
        self.clock.every(0.01, self._live)
        self.clock.at(self.clock.now() + LONGEST, self._give_up)
        self._live()
        prepared = checked(self._to, self.links, self.clock)
        if prepared is None:
            return 1
        code = ControlLoop(self._to, prepared, self.links, self.clock).run()
        self._live()
        return code

    def stopped_by(
        self, act: Callable[[], object], order: Follow, after: float
    ) -> tuple[Stopped, float]:
        """Why the arm stopped after `act` in the middle of a motion, and how long that took [s]."""
        acted = []

        def interfere() -> None:
            assert not self.emulator.controller.snapshot.resting
            acted.append(self.clock.now())
            act()

        self.when(Checked, lambda: self.orders.put(order))
        self.when(Began, interfere, after)
        assert self.run() == 1
        # nothing moves it again
        self.clock.sleep(2.0)
        assert self.emulator.controller.snapshot.resting
        assert self.emulator.controller.snapshot.runtime_state == 1
        assert self.emulator.controller.started == 1
        (stopped,), (event,) = self.reported(Stopped), self.events("stopped")
        assert (event["reason"], event["guard"]) == (stopped.reason, stopped.guard)
        return stopped, max(self.moved) - acted[0]

    def reported(self, kind: type):
        """The reports of a kind."""
        return [report for report in self.reports if isinstance(report, kind)]

    def events(self, kind: str):
        return [event for event in read_events(self.directory) if event["kind"] == kind]

    def close(self) -> None:
        self.orders.close()
        self.links.samples.close()
        self.recorder.close()
        self.links.log.close()

    def _told(self, report: Report) -> None:
        first = not self.reported(type(report))
        self.reports.append(report)
        for kind, after, act in self._reactions if first else ():
            if isinstance(report, kind):
                self.clock.at(self.clock.now() + after, act)

    def _live(self) -> None:
        """What recorder and cameras do meanwhile."""
        for who in {Who.RECORDER, Who.CAMERA_XZ, Who.CAMERA_YZ} - self.silent:
            self.links.board.write(who, Row(self.clock.now(), self.trouble.get(who, 0)))
        while not self.recorder.closed and self.recorder.poll():
            self.rows.extend(self.recorder.recv())
        if self.emulator is not None and not self.emulator.controller.snapshot.resting:
            self.moved.append(self.clock.now())

    def _give_up(self) -> None:
        raise AssertionError(f"no end after {LONGEST:g} s; main was told {self.reports}")


@pytest.fixture
def step_emulator(monkeypatch):
    """Makes a `SteppedController`, and ur_rtde's modules are its clients."""

    def make(clock: SteppedClock, **options):
        emulator = SteppedController(Options(**options), clock)
        for module in ("rtde_receive", "rtde_control"):
            monkeypatch.setitem(sys.modules, module, library(emulator))
        return emulator

    return make


@pytest.fixture
def at_once(monkeypatch):
    """The driver's thread does its work when it is started."""
    monkeypatch.setattr(ur, "Thread", AtOnce)


@pytest.fixture
def stepped_loop(monkeypatch):
    """Makes a `SteppedControl` of an assignment, whose arm goes by the same clock."""
    # the process of the tests keeps its priority
    monkeypatch.setattr(control_loop, "quieten", lambda: None)
    monkeypatch.setattr(control_loop, "hurry", lambda: "normal")
    monkeypatch.setattr(queues, "hurry", lambda: "normal")
    running: list[SteppedControl] = []

    def make(to: Assignment, clock: SteppedClock, emulator: SteppedController | None = None):
        running.append(SteppedControl(to, clock, emulator))
        return running[-1]

    yield make
    for one in running:
        one.close()


@pytest.fixture
def stepped(tmp_path, stepped_loop, step_emulator, at_once):
    """Makes a `SteppedControl` of a rig, a tool, and where that starts in the cup's frame.

    The controller is asked about the start, and about a plan's other poses in the base frame.
    """

    def make(rig: Rig, tool: Tool, start, *, armed: bool = True, cameras: bool = False, plan=()):
        space, clock = workspace(rig, tool), SteppedClock()
        base = cup_frame(rig.cup).to_base(start)
        joints = inverse(space.arm, base, space.start, tcp=space.tcp)
        emulator = step_emulator(clock, joints=tuple(joints.tolist()), seed=1)
        controller = ur.URController(emulator.address)
        probes = np.array([base, *plan]) if armed else np.empty((0, 6))
        to = Assignment(rig, controller, tool, armed, str(tmp_path), probes, cameras)
        return stepped_loop(to, clock, emulator)

    return make
