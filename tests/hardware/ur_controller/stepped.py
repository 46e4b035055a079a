"""An emulator in this thread, on a stepped clock, and the calls of ur_rtde that our driver makes.

They speak to the emulator's ports as the library does. What the library waits for steps the clock
here, so that seconds of the arm last a fraction of them, and are the same each time whatever else
this computer does.
"""

import socket
import struct
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

from stepped_clock import SteppedClock

from . import wire
from .controller import Options
from .loop import ControllerServer
from .network import RTDE, SCRIPT
from .process import free_address
from .program import (
    DONE,
    READY,
    SERVO_L,
    SERVO_STOP,
    SET_PAYLOAD,
    SET_TCP,
    SET_WATCHDOG,
    STOP_SCRIPT,
    TCP_OFFSET,
    WITHIN_LIMITS,
)

ANSWER_TIMEOUT = 10.0  # s of this computer's clock; the emulator answers in this thread

REGISTER_OFFSET = 24  # of the control script's registers, as in ur_rtde
OVER = object()  # of a command of which no step is left
SCRIPT_TEXT = f"def rtde_control():\n# int register offset\n{REGISTER_OFFSET}\nend\n"
INPUT_FIELDS = [
    f"input_int_register_{REGISTER_OFFSET}",
    *(f"input_double_register_{REGISTER_OFFSET + i}" for i in range(18)),
]
OUTPUT_FIELDS = [
    *(
        "runtime_state",
        f"output_int_register_{REGISTER_OFFSET}",
        f"output_int_register_{REGISTER_OFFSET + 1}",
    ),
    *(f"output_double_register_{REGISTER_OFFSET + i}" for i in range(6)),
]


class SteppedController(ControllerServer):
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


class _Client:
    """What is common to ur_rtde's interfaces: one connection, the latest values."""

    emulator: SteppedController

    def __init__(self, outputs: list[str], rate: float):
        self._socket = socket.create_connection((self.emulator.address, RTDE))
        self._socket.setblocking(False)
        self.emulator.clients.append(self._socket)
        self._inbox, self._open = bytearray(), True
        self._latest: dict[str, Any] = {}
        wanted = struct.pack(">d", rate) + ",".join(outputs).encode()
        types = self.ask(wire.OUTPUTS, wanted)[1:].decode().split(",")
        self._outputs = outputs, types, wire.layout(types)
        self.ask(wire.START, b"")

    def ask(self, kind: int, payload: bytes) -> bytes:
        self._socket.sendall(wire.pack(kind, payload))
        end = time.monotonic() + ANSWER_TIMEOUT
        while time.monotonic() < end:
            self.emulator.network.poll(0.0)
            for package in self._packages():
                if package.type == kind:
                    return package.payload
        raise TimeoutError(f"no answer to a package of type {kind} in {ANSWER_TIMEOUT:g} s")

    def value(self, name: str) -> Any:
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


class _Receive(_Client):
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


class _Control(_Client):
    """In place of `RTDEControlInterface`; what the real one waits for steps the clock here."""

    FLAG_UPLOAD_SCRIPT, FLAG_NO_WAIT = 1, 8

    def __init__(self, _: str, rate: float, flag: int):
        super().__init__(OUTPUT_FIELDS, rate)
        self._period = 1.0 / rate
        self._layout = wire.layout(["INT32"] + 18 * ["DOUBLE"])
        answer = self.ask(wire.INPUTS, ",".join(INPUT_FIELDS).encode())
        if b"IN_USE" in answer:
            raise RuntimeError("registers already in use")
        self._later: list[Iterator[None]] = []  # commands that nobody waits for, one after another
        self._goes_on = False
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
        return [self.value(f"output_double_register_{REGISTER_OFFSET + i}") for i in range(6)]

    def isPoseWithinSafetyLimits(self, pose: list[float]) -> bool:
        self._wait(WITHIN_LIMITS, pose)
        return self.value(f"output_int_register_{REGISTER_OFFSET + 1}") == 1

    def setWatchdog(self, frequency: float) -> bool:
        return self._wait(SET_WATCHDOG, [frequency])

    def servoL(self, pose: list[float], *numbers: float) -> bool:
        speed, acceleration, period, lookahead, gain = numbers
        self._send(SERVO_L, [*pose, speed, acceleration, period, lookahead, gain])
        return self._runs()

    def servoStop(self, deceleration: float) -> None:
        """The real one waits, in the driver's own thread; here the clock goes on with it."""
        self._later.append(self._carried_out(SERVO_STOP, [deceleration]))
        if not self._goes_on:
            self._goes_on = True
            self.emulator.clock.every(self._period, self._go_on)

    def stopScript(self) -> None:
        self._later.append(self._ended())

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
            while self._runs() and self.value(f"output_int_register_{REGISTER_OFFSET}") != answer:
                yield

    def _ended(self) -> Iterator[None]:
        """The script ends, and answers nothing."""
        self._send(STOP_SCRIPT, [])
        yield from ()

    def _go_on(self) -> None:
        """One more step of the first command that is not carried out yet."""
        if self._later and next(self._later[0], OVER) is OVER:
            self._later.pop(0)

    def _send(self, command: int, numbers: list[float]) -> None:
        values = [*numbers, *(18 - len(numbers)) * [0.0]]
        if self._open:
            self._socket.sendall(wire.pack(wire.DATA, self._layout.pack(1, command, *values)))


def library(emulator: SteppedController) -> SimpleNamespace:
    """Stands for the modules `rtde_receive` and `rtde_control`, whatever address they are given."""
    own = {"emulator": emulator}
    return SimpleNamespace(
        RTDEReceiveInterface=type("Receive", (_Receive,), own),
        RTDEControlInterface=type("Control", (_Control,), own),
    )
