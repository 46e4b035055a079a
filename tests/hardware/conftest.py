"""The motion loop, its driver and the emulator in this thread, on a clock that the test steps.

`ur_rtde` alone is replaced, by the few calls of it that the driver makes; they speak the same
protocol to the emulator's ports. So a test of seconds lasts a fraction of them, and is the same
each time whatever else this computer does.
"""

import socket
import struct
import sys
from collections.abc import Callable, Iterator
from queue import Queue
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.hardware.board import SPAWN, Board, Row, Who
from bolfi_liquids.hardware.emulator import wire
from bolfi_liquids.hardware.emulator.controller import Options
from bolfi_liquids.hardware.emulator.loop import Emulator
from bolfi_liquids.hardware.emulator.network import RTDE, SCRIPT
from bolfi_liquids.hardware.emulator.process import free_address
from bolfi_liquids.hardware.frames import cup_frame
from bolfi_liquids.hardware.host_clock import SteppedClock
from bolfi_liquids.hardware.kinematics import inverse
from bolfi_liquids.hardware.recorder.events import EventLog, read_events
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.robot import control_loop, inbox, ur
from bolfi_liquids.hardware.robot.control_loop import ControlLoop, Links
from bolfi_liquids.hardware.robot.control_process import checked
from bolfi_liquids.hardware.robot.orders import (
    Assignment,
    Began,
    Checked,
    Follow,
    Order,
    Report,
    Stopped,
)
from bolfi_liquids.hardware.safety.limits import Tool, workspace

OFFSET = 24  # of the control script's registers, as in ur_rtde
READY, DONE = 1, 2
SERVO_L, SERVO_STOP, SET_PAYLOAD, SET_TCP = 24, 16, 17, 29
SET_WATCHDOG, WITHIN_LIMITS, TCP_OFFSET, STOP_SCRIPT = 35, 36, 40, 255
SCRIPT_TEXT = (
    f"def rtde_control():\n# int register offset\n{OFFSET}\n# inject move path\n\tend\nend\n"
)
INPUTS = [
    f"input_int_register_{OFFSET}",
    *(f"input_double_register_{OFFSET + i}" for i in range(18)),
]
OUTPUTS = [
    *("runtime_state", f"output_int_register_{OFFSET}", f"output_int_register_{OFFSET + 1}"),
    *(f"output_double_register_{OFFSET + i}" for i in range(6)),
]
LONGEST = 120.0  # s of the stepped clock, after which a test has failed


class SteppedEmulator(Emulator):
    """An emulator whose ticks a stepped clock makes."""

    def __init__(self, options: Options, clock: SteppedClock):
        self.address = free_address()
        self.clock = clock
        self.clients: list[socket.socket] = []
        super().__init__(self.address, options, clock)
        clock.every(self.controller.dt, lambda: self.turn(clock.now()))

    def close(self) -> None:
        for client in self.clients:
            client.close()
        super().close()


class Client:
    """What is common to ur_rtde's interfaces: one connection, the latest values."""

    emulator: SteppedEmulator

    def __init__(self, outputs: list[str], rate: float):
        self._socket = socket.create_connection((self.emulator.address, RTDE))
        self._socket.setblocking(False)
        self.emulator.clients.append(self._socket)
        self._inbox, self._open, self._latest = bytearray(), True, {}
        wanted = struct.pack(">d", rate) + ",".join(outputs).encode()
        types = self.ask(wire.OUTPUTS, wanted)[1:].decode().split(",")
        self._outputs = outputs, types, wire.layout(types)
        self.ask(wire.START, b"")

    def ask(self, kind: int, payload: bytes) -> bytes:
        self._socket.sendall(wire.pack(kind, payload))
        while True:
            self.emulator.network.poll(0.0)
            for package in self._packages():
                if package.type == kind:
                    return package.payload

    def value(self, name: str):
        """Of the latest package; it stays what it was once the link is lost."""
        self.isConnected()
        return self._latest[name]

    def isConnected(self) -> bool:
        for package in self._packages():
            self._keep(package)
        return self._open

    def disconnect(self) -> None:
        self._open = False
        self._socket.close()

    def _packages(self) -> Iterator[wire.Package]:
        while self._open:
            try:
                data = self._socket.recv(65536)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            self._open = bool(data)
            self._inbox += data
        while (package := wire.take(self._inbox)) is not None:
            yield package

    def _keep(self, package: wire.Package) -> None:
        names, types, layout = self._outputs
        _, *flat = layout.unpack(package.payload)
        for name, kind in zip(names, types, strict=True):
            size = int(kind[6]) if kind.startswith("VECTOR") else 1
            one, flat = flat[:size], flat[size:]
            self._latest[name] = one if size > 1 else one[0]


class Receive(Client):
    """In place of `RTDEReceiveInterface`."""

    def __init__(self, _: str, rate: float, fields: list[str]):
        super().__init__(fields, rate)
        # the library waits for the first package, too
        while "timestamp" not in self._latest:
            self.emulator.clock.sleep(1.0 / rate)
            self.isConnected()

    def __getattr__(self, name: str) -> Callable[[], object]:
        return lambda: self.value(GETTERS[name])


GETTERS = {
    "getTimestamp": "timestamp",
    "getActualQ": "actual_q",
    "getActualTCPPose": "actual_TCP_pose",
    "getActualTCPSpeed": "actual_TCP_speed",
    "getActualTCPForce": "actual_TCP_force",
    "getRobotMode": "robot_mode",
    "getRuntimeState": "runtime_state",
    "getSafetyStatusBits": "safety_status_bits",
    "getSpeedScaling": "speed_scaling",
    "getTargetSpeedFraction": "target_speed_fraction",
    "getPayload": "payload",
    "getPayloadCog": "payload_cog",
}


class Control(Client):
    """In place of `RTDEControlInterface`; what the real one waits for steps the clock here."""

    FLAG_UPLOAD_SCRIPT, FLAG_NO_WAIT = 1, 8

    def __init__(self, _: str, rate: float, flag: int):
        super().__init__(OUTPUTS, rate)
        self._period = 1.0 / rate
        self._layout = wire.layout(["INT32"] + 18 * ["DOUBLE"])
        answer = self.ask(wire.INPUTS, ",".join(INPUTS).encode())
        if b"IN_USE" in answer:
            raise RuntimeError("registers already in use")
        self._later: list[Iterator[None]] = []
        if flag == self.FLAG_UPLOAD_SCRIPT:
            with socket.create_connection((self.emulator.address, SCRIPT)) as upload:
                upload.sendall(SCRIPT_TEXT.encode())
                self.emulator.clock.sleep(3 * self._period)

    def __del__(self):
        self.disconnect()

    def setTcp(self, offset: list[float]) -> bool:
        return self._wait(SET_TCP, offset)

    def setPayload(self, mass: float, centre: list[float]) -> bool:
        return self._wait(SET_PAYLOAD, [mass, *centre])

    def getTCPOffset(self) -> list[float]:
        self._wait(TCP_OFFSET, [])
        return [self.value(f"output_double_register_{OFFSET + i}") for i in range(6)]

    def isPoseWithinSafetyLimits(self, pose: list[float]) -> bool:
        self._wait(WITHIN_LIMITS, pose)
        return self.value(f"output_int_register_{OFFSET + 1}") == 1

    def setWatchdog(self, frequency: float) -> bool:
        return self._wait(SET_WATCHDOG, [frequency])

    def servoL(self, pose: list[float], *numbers: float) -> bool:
        speed, acceleration, period, lookahead, gain = numbers
        self._send(SERVO_L, [*pose, speed, acceleration, period, lookahead, gain])
        return self._runs()

    def servoStop(self, deceleration: float) -> None:
        """The real one waits, in the driver's own thread; here the clock goes on with it."""
        self._later.append(self._carried_out(SERVO_STOP, [deceleration]))
        self.emulator.clock.every(self._period, self._go_on)

    def stopScript(self) -> None:
        self._later.append(iter(lambda: self._send(STOP_SCRIPT, []), None))

    def _runs(self) -> bool:
        return self.isConnected() and self.value("runtime_state") == 2

    def _wait(self, command: int, numbers: list[float]) -> bool:
        for _ in self._carried_out(command, numbers):
            self.emulator.clock.sleep(self._period)
        return self._runs()

    def _carried_out(self, command: int, numbers: list[float]) -> Iterator[None]:
        """The script carries a command out, and is ready for the next; one step a period."""
        for sent, answer in ((command, DONE), (0, READY)):
            self._send(sent, numbers)
            yield
            while self._runs() and self.value(f"output_int_register_{OFFSET}") != answer:
                yield

    def _go_on(self) -> None:
        if self._later and next(self._later[0], self) is self:
            self._later.pop(0)

    def _send(self, command: int, numbers: list[float]) -> None:
        values = [*numbers, *(18 - len(numbers)) * [0.0]]
        if self._open:
            self._socket.sendall(wire.pack(wire.DATA, self._layout.pack(1, command, *values)))


class AtOnce:
    """In place of the driver's thread, which has nothing to wait for here."""

    def __init__(self, target: Callable[[], None], **_: object):
        self.start = target

    def join(self, _: float) -> None:
        Client.emulator.clock.sleep(0.1)


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
        rows: Samples that the recorder is given.
        silent: Others that give no more signs of life.
        trouble: What the others complain of.
        moved: Host times of ticks in which the arm moved [s].
    """

    def __init__(self, directory, rig: Rig, tool: Tool, start, *, armed: bool, cameras: bool):
        space = workspace(rig, tool)
        base = cup_frame(rig.cup).to_base(start)
        joints = inverse(space.arm, base, space.start, tcp=space.tcp).joints
        self.clock = SteppedClock()
        self.directory = directory
        self.emulator = SteppedEmulator(Options(joints=tuple(joints.tolist()), seed=1), self.clock)
        Client.emulator = self.emulator
        self.reports: list[Report] = []
        self.rows, self.silent, self.trouble, self.moved = [], set(), {}, []
        self._reactions: list[tuple[type, float, Callable[[], object]]] = []
        self.orders = Orders(self._told)
        self._samples, writing = SPAWN.Pipe(duplex=False)
        log = EventLog(directory, "control")
        self.links = Links(Board(), self.orders, writing, log, [])
        probes = base[None] if armed else np.empty((0, 6))
        address = self.emulator.address
        self._to = Assignment(rig, address, tool, armed, str(directory), probes, cameras=cameras)

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
        assert self.emulator.controller.arm.started == 1
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
        self._samples.close()
        self.links.log.close()
        self.emulator.close()

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
        while self._samples.poll():
            self.rows.extend(self._samples.recv())
        if not self.emulator.controller.snapshot.resting:
            self.moved.append(self.clock.now())

    def _give_up(self) -> None:
        raise AssertionError(f"no end after {LONGEST:g} s; main was told {self.reports}")


@pytest.fixture
def stepped(tmp_path, monkeypatch):
    """Makes a `SteppedControl` of a rig, a tool, and where that starts in the cup's frame."""
    library = SimpleNamespace(RTDEReceiveInterface=Receive, RTDEControlInterface=Control)
    for module in ("rtde_receive", "rtde_control"):
        monkeypatch.setitem(sys.modules, module, library)
    monkeypatch.setattr(ur, "Thread", AtOnce)
    # the process of the tests keeps its priority
    monkeypatch.setattr(control_loop, "quieten", lambda: None)
    monkeypatch.setattr(control_loop, "hurry", lambda: "normal")
    monkeypatch.setattr(inbox, "hurry", lambda: "normal")
    running: list[SteppedControl] = []

    def make(rig: Rig, tool: Tool, start, *, armed: bool = True, cameras: bool = False):
        running.append(SteppedControl(tmp_path, rig, tool, start, armed=armed, cameras=cameras))
        return running[-1]

    yield make
    for one in running:
        one.close()
