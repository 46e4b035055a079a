"""An emulator in this thread, on a stepped clock, and the calls of ur_rtde that our driver makes.

What the library waits for steps the clock here, so that seconds of the arm last a fraction of them,
and are the same each time whatever else this computer does.
"""

from collections import deque
from collections.abc import Callable, Iterator
from types import SimpleNamespace

from stepped_clock import SteppedClock

from .machine import (
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
    Controller,
    Options,
    Snapshot,
)

FIRST = 24  # of the control script's registers, as in ur_rtde
OVER = object()  # of a command of which no step is left
SCRIPT_TEXT = f"def rtde_control():\n# int register offset\n{FIRST}\nend\n"


class AtOnce:
    """In place of the driver's thread, which has nothing to wait for here."""

    def __init__(self, target: Callable[[], None], **_: object):
        self.start = target

    def join(self, _: float) -> None:
        """Nothing is left to wait for."""


class SteppedController:
    """An emulator whose ticks a stepped clock makes, and its link to clients.

    Attributes:
        address: For messages.
        controller: Behind the link.
        late: Data packages come so much later [s].
        published: The latest package that has come.
    """

    address = "127.0.0.1"

    def __init__(self, options: Options, clock: SteppedClock):
        self.clock, self.controller = clock, Controller(options, clock)
        self.published, self.late, self.clients = self.controller.snapshot, 0.0, []
        self._on_the_way: deque[tuple[float, Snapshot]] = deque()
        self._held: list[dict[str, float]] = []  # what clients sent to a frozen link
        self._frozen_until = 0.0
        clock.every(self.controller.dt, self._tick)

    def freeze(self, seconds: float) -> None:
        """Nothing comes or goes for a while, and the link looks sound."""
        self._frozen_until = self.clock.now() + seconds

    def drop(self) -> None:
        """Close all connections."""
        for client in self.clients:
            client.disconnect()

    def reconnect(self) -> None:
        """Open them again, as the library does by itself."""
        for client in self.clients:
            client.connected = True

    def send(self, values: dict[str, float]) -> None:
        """A client's package; on a frozen link it waits."""
        if self.clock.now() < self._frozen_until:
            self._held.append(values)
        else:
            self.controller.receive(values)

    def _tick(self) -> None:
        now = self.clock.now()
        frozen = now < self._frozen_until
        while self._held and not frozen:
            self.controller.receive(self._held.pop(0))
        self._on_the_way.append((now + self.late, self.controller.tick()))
        if frozen:
            self._on_the_way.clear()
        while self._on_the_way and self._on_the_way[0][0] <= now:
            self.published = self._on_the_way.popleft()[1]


class _Client:
    """What is common to ur_rtde's interfaces: one connection, the latest values."""

    emulator: SteppedController

    def __init__(self):
        self.connected, self._last = True, self.emulator.published
        self.emulator.clients.append(self)

    @property
    def latest(self) -> Snapshot:
        """It stays what it was once the link is lost."""
        if self.connected:
            self._last = self.emulator.published
        return self._last

    def isConnected(self) -> bool:
        return self.connected

    def disconnect(self) -> None:
        self._last, self.connected = self.latest, False


GETTERS: dict[str, Callable[[Snapshot], object]] = {
    "getTimestamp": lambda s: s.time,
    "getActualQ": lambda s: s.joints,
    "getActualTCPPose": lambda s: s.pose,
    "getActualTCPSpeed": lambda s: s.velocity,
    "getActualTCPForce": lambda s: s.force,
    "getRobotMode": lambda _: 7,
    "getRuntimeState": lambda s: s.runtime_state,
    "getSafetyStatusBits": lambda s: s.safety_bits,
    "getSpeedScaling": lambda _: 1.0,
    "getTargetSpeedFraction": lambda _: 1.0,
    "getPayload": lambda s: s.payload,
    "getPayloadCog": lambda s: s.payload_centre,
}


class _Receive(_Client):
    """In place of `RTDEReceiveInterface`."""

    def __init__(self, *_: object):
        super().__init__()

    def __getattr__(self, name: str) -> Callable[[], object]:
        getter = GETTERS[name]
        return lambda: getter(self.latest)


class _Control(_Client):
    """In place of `RTDEControlInterface`; what the real one waits for steps the clock here."""

    FLAG_UPLOAD_SCRIPT, FLAG_NO_WAIT = 1, 8

    def __init__(self, _: str, rate: float, flag: int):
        super().__init__()
        self._period = 1.0 / rate
        self._later: list[Iterator[None]] = []  # commands that nobody waits for, one after another
        self._goes_on = False
        if flag == self.FLAG_UPLOAD_SCRIPT:
            self.emulator.controller.load(SCRIPT_TEXT)
            self.emulator.clock.sleep(3 * self._period)

    def setTcp(self, offset: list[float]) -> bool:
        return self._wait(SET_TCP, offset)

    def setPayload(self, mass: float, centre: list[float]) -> bool:
        return self._wait(SET_PAYLOAD, [mass, *centre])

    def getTCPOffset(self) -> tuple[float, ...]:
        self._wait(TCP_OFFSET, [])
        return self.latest.output_doubles[FIRST : FIRST + 6]

    def isPoseWithinSafetyLimits(self, pose: list[float]) -> bool:
        self._wait(WITHIN_LIMITS, pose)
        return self.latest.output_ints[FIRST + 1] == 1

    def setWatchdog(self, frequency: float) -> bool:
        return self._wait(SET_WATCHDOG, [frequency])

    def servoL(self, pose: list[float], *numbers: float) -> bool:
        self._send(SERVO_L, [*pose, *numbers])
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
        return self.connected and self.latest.runtime_state == 2

    def _wait(self, command: int, numbers: list[float]) -> bool:
        for _ in self._carried_out(command, numbers):
            self.emulator.clock.sleep(self._period)
        return self._runs()

    def _carried_out(self, command: int, numbers: list[float]) -> Iterator[None]:
        """The script carries a command out, and is ready for the next; one step a period."""
        for sent, answer in ((command, DONE), (0, READY)):
            self._send(sent, numbers)
            yield
            while self._runs() and self.latest.output_ints[FIRST] != answer:
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
        if self.connected:
            names = (f"input_double_register_{FIRST + i}" for i in range(len(numbers)))
            values = dict(zip(names, numbers, strict=True))
            self.emulator.send({f"input_int_register_{FIRST}": command} | values)


def library(emulator: SteppedController) -> SimpleNamespace:
    """Stands for the modules `rtde_receive` and `rtde_control`, whatever address they are given."""
    own = {"emulator": emulator}
    return SimpleNamespace(
        RTDEReceiveInterface=type("Receive", (_Receive,), own),
        RTDEControlInterface=type("Control", (_Control,), own),
    )
