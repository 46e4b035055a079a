"""The controller's ports, served by one thread: RTDE, scripts, dashboard, and the tests' own."""

import argparse
import asyncio
import json
import re
import selectors
import signal
import struct
import sys
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from bolfi_liquids.hardware.emulated.arm import MAX_LATENESS
from bolfi_liquids.hardware.process import hurry

from .machine import REGISTERS, Controller, Options, Snapshot

RTDE, SCRIPT, DASHBOARD, ADMIN = 30004, 30003, 29999, 29997
MOST_UNSENT = 1 << 18  # bytes; a client that reads no more than this loses what comes later
HEADER = struct.Struct(">HB")  # of a package of RTDE, big-endian: size with this header, type
VERSION, CONTROLLER, DATA, OUTPUTS, INPUTS, START, PAUSE = b"VvUOISP"
CODES = {"UINT32": "I", "INT32": "i", "DOUBLE": "d", "VECTOR3D": "3d", "VECTOR6D": "6d"}
SCRIPT_END = re.compile(rb"^end[ \t\r]*\n", re.MULTILINE)


class Field(NamedTuple):
    """An output variable of RTDE: its type's name, and its value of the moment."""

    type: str
    value: Callable[[Snapshot], tuple]


FIELDS: dict[str, Field] = {
    "timestamp": Field("DOUBLE", lambda s: (s.time,)),
    "actual_q": Field("VECTOR6D", lambda s: s.joints),
    "actual_TCP_pose": Field("VECTOR6D", lambda s: s.pose),
    "actual_TCP_speed": Field("VECTOR6D", lambda s: s.velocity),
    "actual_TCP_force": Field("VECTOR6D", lambda s: s.force),
    "robot_mode": Field("INT32", lambda _: (7,)),
    "speed_scaling": Field("DOUBLE", lambda _: (1.0,)),
    "target_speed_fraction": Field("DOUBLE", lambda _: (1.0,)),
    "runtime_state": Field("UINT32", lambda s: (s.runtime_state,)),
    "robot_status_bits": Field("UINT32", lambda s: (1 | 2 * (s.runtime_state == 2),)),
    "safety_status_bits": Field("UINT32", lambda s: (s.safety_bits,)),
    "payload": Field("DOUBLE", lambda s: (s.payload,)),
    "payload_cog": Field("VECTOR3D", lambda s: s.payload_centre),
}
INPUT_TYPES = {"external_force_torque": "VECTOR6D"}
for _i in range(REGISTERS):
    FIELDS[f"output_int_register_{_i}"] = Field("INT32", lambda s, i=_i: s.output_ints[i : i + 1])
    FIELDS[f"output_double_register_{_i}"] = Field(
        "DOUBLE", lambda s, i=_i: s.output_doubles[i : i + 1]
    )
    INPUT_TYPES |= {f"input_int_register_{_i}": "INT32", f"input_double_register_{_i}": "DOUBLE"}


def layout(types: list[str]) -> struct.Struct:
    """Recipe number, then fields of these types."""
    return struct.Struct(">B" + "".join(CODES[kind] for kind in types))


def names(payload: bytes) -> list[str]:
    """Names of variables from a comma-separated list; ur_rtde ends it with a comma."""
    return [name for name in payload.decode("ascii", "replace").split(",") if name]


class Link(asyncio.Protocol):
    """One client of one port; `take` handles what has come in."""

    def __init__(self, server: "ControllerServer"):
        self.server, self.controller = server, server.controller
        self.inbox = bytearray()

    def connection_made(self, transport) -> None:
        self.transport = transport
        self.server.links.append(self)
        if self.server.frozen:
            self.pause()

    def connection_lost(self, exc: Exception | None) -> None:
        self.server.links.remove(self)

    def data_received(self, data: bytes) -> None:
        self.inbox += data
        try:
            self.take()
        except (ValueError, KeyError, struct.error):  # senseless bytes end their own connection
            self.transport.abort()

    def take(self) -> None:
        raise NotImplementedError

    def lines(self) -> list[str]:
        """Whole lines that have come in."""
        *whole, self.inbox = self.inbox.split(b"\n")
        return [line.decode("utf-8", "replace").strip() for line in whole]

    def send(self, data: bytes) -> None:
        if self.transport.get_write_buffer_size() < MOST_UNSENT:
            self.transport.write(data)

    def pause(self) -> None:
        """Read nothing, as a frozen robot does."""
        self.transport.pause_reading()

    def resume(self) -> None:
        self.transport.resume_reading()


class RtdeLink(Link):
    """Real-Time Data Exchange, protocol version 2: a client's recipes, and its data."""

    def __init__(self, server: "ControllerServer"):
        super().__init__(server)
        self.inputs: list[tuple[list[str], struct.Struct]] = []
        self._outputs: list[Field] = []
        self._layout, self._every, self._started = layout([]), 1, False

    def take(self) -> None:
        answers = {
            VERSION: lambda _: bytes([1]),
            CONTROLLER: lambda _: struct.pack(">4I", *self.controller.version),
            OUTPUTS: self._set_up_outputs,
            INPUTS: self._set_up_inputs,
            START: lambda _: self._start(True),
            PAUSE: lambda _: self._start(False),
            DATA: self._take_data,
        }
        while len(self.inbox) >= HEADER.size:
            size, kind = HEADER.unpack_from(self.inbox)
            if len(self.inbox) < max(size, HEADER.size):
                break
            payload = bytes(self.inbox[HEADER.size : size])
            del self.inbox[: max(size, HEADER.size)]
            if (reply := answers[kind](payload)) is not None:
                self._package(kind, reply)

    def publish(self, snapshot: Snapshot, tick: int) -> None:
        """One tick: send the data, if this client's turn has come."""
        if self._started and tick % self._every == 0:
            flat = [value for field in self._outputs for value in field.value(snapshot)]
            self._package(DATA, self._layout.pack(1, *flat))

    def _package(self, kind: int, payload: bytes) -> None:
        self.send(HEADER.pack(HEADER.size + len(payload), kind) + payload)

    def _start(self, started: bool) -> bytes:
        self._started = started and bool(self._outputs)
        return bytes([1])

    def _set_up_outputs(self, payload: bytes) -> bytes:
        (frequency,) = struct.unpack_from(">d", payload)
        found = [FIELDS.get(name) for name in names(payload[8:])]
        types = ["NOT_FOUND" if field is None else field.type for field in found]
        if "NOT_FOUND" not in types:
            self._outputs, self._layout = [one for one in found if one], layout(types)
        # the controller divides its rate by a whole number
        self._every = max(1, int(self.controller.rate / frequency + 1e-9)) if frequency else 1
        return bytes([1]) + ",".join(types).encode()

    def _set_up_inputs(self, payload: bytes) -> bytes:
        wanted, others = names(payload), [one for one in self.server.robot if one is not self]
        taken = {
            n for one in others if isinstance(one, RtdeLink) for of, _ in one.inputs for n in of
        }
        types = ["IN_USE" if name in taken else INPUT_TYPES[name] for name in wanted]
        if "IN_USE" not in types:
            self.inputs.append((wanted, layout(types)))
        number = 0 if "IN_USE" in types else len(self.inputs)
        return bytes([number]) + ",".join(types).encode()

    def _take_data(self, payload: bytes) -> None:
        wanted, fields = self.inputs[payload[0] - 1]
        # ur_rtde sends more than the recipe holds now and then; the controller reads what it needs
        flat = list(fields.unpack_from(payload))[1:]
        sizes = [6 if INPUT_TYPES[name] == "VECTOR6D" else 1 for name in wanted]
        parts = [[flat.pop(0) for _ in range(size)] for size in sizes]
        self.controller.receive(
            {n: p[0] for n, p in zip(wanted, parts, strict=True) if len(p) == 1}
        )


class ScriptLink(Link):
    """Upload of scripts. What the real port streams, ur_rtde never reads."""

    def take(self) -> None:
        while (found := SCRIPT_END.search(self.inbox)) is not None:
            script = bytes(self.inbox[: found.end()]).decode("utf-8", "replace")
            del self.inbox[: found.end()]
            self.controller.load(script)


class DashboardLink(Link):
    """Lines of text, an answer to each: what ur_rtde asks when it connects."""

    def connection_made(self, transport) -> None:
        super().connection_made(transport)
        self.send(b"Connected: Universal Robots Dashboard Server\n")

    def take(self) -> None:
        answers = {
            "polyscopeversion": self.controller.dated,
            "get serial number": "20210000000",
            "is in remote control": "true",
        }
        for line in self.lines():
            self.send(answers.get(line.lower(), f'could not understand: "{line}"').encode() + b"\n")


class AdminLink(Link):
    """What no real controller offers: JSON, a line for each request and reply."""

    streaming = False

    def take(self) -> None:
        machine = self.controller
        commands = {
            "state": lambda: None,
            "stream": lambda: setattr(self, "streaming", True),
            "force": lambda of: setattr(machine, "pressed", tuple(of)),
            "protective_stop": lambda: machine.protective_stop("asked for at the admin port"),
            "freeze": self.server.freeze,
            "drop": self.server.drop,
        }
        for line in self.lines():
            command, *arguments = json.loads(line)
            commands[command](*arguments)
            self.tell()

    def tell(self) -> None:
        """The state after the latest tick."""
        machine = self.controller
        told = machine.snapshot._asdict() | {"reason": machine.reason, "started": machine.started}
        self.send(json.dumps(told).encode() + b"\n")

    def pause(self) -> None:
        """It is not the robot's."""

    resume = pause


PORTS = {RTDE: RtdeLink, SCRIPT: ScriptLink, DASHBOARD: DashboardLink, ADMIN: AdminLink}


class ControllerServer:
    """A controller with its four ports open."""

    def __init__(self, options: Options):
        self.controller = Controller(options)
        self.links: list[Link] = []
        self._frozen_until = 0.0

    @property
    def robot(self) -> list[Link]:
        """Clients of the robot's own ports."""
        return [link for link in self.links if not isinstance(link, AdminLink)]

    @property
    def frozen(self) -> bool:
        return self.controller.clock.now() < self._frozen_until

    def freeze(self, seconds: float) -> None:
        """Robot's ports take and send nothing for a while; their sockets stay open."""
        self._frozen_until = self.controller.clock.now() + seconds
        for link in self.robot:
            link.pause()
        asyncio.get_running_loop().call_later(seconds, self._thaw)

    def _thaw(self) -> None:
        for link in self.robot:
            link.resume()

    def drop(self) -> None:
        """Close all connections but the admin's; the ports go on listening."""
        for link in self.robot:
            link.transport.abort()

    async def serve(self, address: str, told: list[int]) -> None:
        """Listen and tick until something is told."""
        loop, now = asyncio.get_running_loop(), self.controller.clock.now
        for port, kind in PORTS.items():
            await loop.create_server(partial(kind, self), address, port)
        print(f"ready {address}", flush=True)
        deadline, tick = now(), 0
        while not told:
            deadline, tick = deadline + self.controller.dt, tick + 1
            await asyncio.sleep(max(deadline - now(), 0.0))
            await asyncio.sleep(
                0
            )  # what came while this process had no time counts before the tick
            self._tick(tick)
            late = now() - deadline
            if late > MAX_LATENESS:
                ticks = int(late / self.controller.dt)
                self.controller.skip(ticks)
                deadline += ticks * self.controller.dt
                print(f"emulator: {ticks} ticks late, left out", file=sys.stderr, flush=True)

    def _tick(self, tick: int) -> None:
        snapshot, frozen = self.controller.tick(), self.frozen
        for link in list(self.links):
            if isinstance(link, RtdeLink) and not frozen:
                link.publish(snapshot, tick)
            elif isinstance(link, AdminLink) and link.streaming:
                link.tell()


def main() -> int:
    """Run an emulator until a signal, or the end of the input."""
    parser = argparse.ArgumentParser(prog="python -m ur_controller", description=__doc__)
    parser.add_argument("address", help="one of 127.0.0.0/8")
    parser.add_argument("options", type=json.loads, help="JSON: fields of `Options`")
    given = parser.parse_args()
    if not given.address.startswith("127."):
        parser.error("use an address of this computer alone: anyone could move an open emulator")
    told: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: told.append(received))

    async def run() -> None:
        # anything but the input's end is of no interest
        asyncio.get_running_loop().add_reader(
            sys.stdin, lambda: sys.stdin.buffer.read1(65536) or told.append(0)
        )
        await ControllerServer(Options(**given.options)).serve(given.address, told)

    hurry()  # a controller keeps its time whatever else this computer does
    # `select` waits by the microsecond, `epoll` by the millisecond
    factory = partial(asyncio.SelectorEventLoop, selectors.SelectSelector())
    with asyncio.Runner(loop_factory=factory) as runner:
        runner.run(run())
    return 0
