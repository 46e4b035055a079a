"""Client of an emulator's admin port."""

import json
import socket
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .network import ADMIN


class EmulatedArmState(NamedTuple):
    """State of the emulated arm.

    Attributes:
        time: Robot clock [s].
        pose: TCP in the base frame [m, rad].
        speed: Of the TCP [m/s, rad/s].
        joints: [rad].
        at_rest: Whether no joint moves.
        runtime_state: 1 stopped, 2 playing.
        safety_bits: RTDE's `safety_status_bits`: bit 0 normal, bit 2 protective stop.
        host: Host clock [s].
        reason: Why the program stopped last; empty if it never did.
    """

    time: float
    pose: tuple[float, ...]
    speed: tuple[float, ...]
    joints: tuple[float, ...]
    at_rest: bool
    runtime_state: int
    safety_bits: int
    host: float
    reason: str


class AdminError(RuntimeError):
    """The emulator refused a request."""


class Admin:
    """Looks behind the emulated controller and injects faults; each call has its own connection.

    Args:
        address: Of the emulator.
        timeout: For a reply [s].
    """

    def __init__(self, address: str, *, timeout: float = 5.0):
        self._address = address
        self._timeout = timeout

    def state(self) -> EmulatedArmState:
        return _state(self._ask("state"))

    def stream(self) -> Iterator[EmulatedArmState]:
        """The state of every tick; ends when the emulator does. Close the iterator after use."""
        with self._connect() as link, link.makefile("rw", encoding="utf-8") as lines:
            lines.write('{"command": "stream"}\n')
            lines.flush()
            for line in lines:
                yield _state(json.loads(line))

    def force(self, wrench: Sequence[float]) -> None:
        """Press with this force [N] and torque [Nm] at the TCP until the next call."""
        self._ask("force", value=[float(value) for value in wrench])

    def protective_stop(self) -> None:
        self._ask("protective_stop")

    def freeze(self, seconds: float) -> None:
        """The robot's ports stand still for a while; the arm and its watchdog go on."""
        self._ask("freeze", seconds=seconds)

    def drop(self) -> None:
        """Close all connections to the robot's ports."""
        self._ask("drop")

    def motions(self) -> int:
        """How often the arm began to move since the start."""
        return int(self._ask("motions")["started"])

    def _connect(self) -> socket.socket:
        return socket.create_connection((self._address, ADMIN), timeout=self._timeout)

    def _ask(self, command: str, **arguments: object) -> dict:
        with self._connect() as link, link.makefile("rw", encoding="utf-8") as lines:
            lines.write(json.dumps({"command": command, **arguments}) + "\n")
            lines.flush()
            reply = lines.readline()
        if not reply:
            raise AdminError(f"the emulator at {self._address} closed without a reply")
        answer = json.loads(reply)
        if "error" in answer:
            raise AdminError(f"the emulator at {self._address}: {answer['error']}")
        return answer


def _state(reply: dict) -> EmulatedArmState:
    return EmulatedArmState(
        time=reply["time"],
        pose=tuple(reply["pose"]),
        speed=tuple(reply["speed"]),
        joints=tuple(reply["joints"]),
        at_rest=reply["at_rest"],
        runtime_state=reply["runtime_state"],
        safety_bits=reply["safety_bits"],
        host=reply["host"],
        reason=reply["reason"],
    )
