"""Admin port 29997: what no real controller offers. JSON, a line for each request and reply."""

import json
import math
from collections.abc import Callable
from typing import Any

from .controller import Controller
from .network import Connection, Network
from .snapshot import Snapshot


class Faults:
    """Faults of the link, of which the event loop takes care.

    Attributes:
        network: The sockets; set by who builds it.
        late: Data packages come so much later [s].
    """

    def __init__(self):
        self.network: Network | None = None
        self.late = 0.0

    def freeze(self, seconds: float) -> None:
        if self.network is not None:
            self.network.freeze(seconds)

    def drop(self) -> None:
        if self.network is not None:
            self.network.drop()


class AdminSession:
    """One client; streams the state once it has asked for that."""

    def __init__(self, connection: Connection, controller: Controller, faults: Faults):
        self._connection = connection
        self._controller = controller
        self._faults = faults
        self._streaming = False
        self._commands: dict[str, Callable[[dict], dict]] = {
            "state": lambda _: self._state(),
            "force": self._force,
            "protective_stop": self._protective_stop,
            "freeze": lambda request: _done(faults.freeze(_seconds(request))),
            "drop": lambda _: _done(faults.drop()),
            "motions": lambda _: {"started": controller.started},
        }

    def received(self) -> None:
        inbox = self._connection.inbox
        while b"\n" in inbox:
            line, _, rest = bytes(inbox).partition(b"\n")
            inbox[:] = rest
            self._reply(self._answer(line))

    def publish(self, snapshot: Snapshot) -> None:
        if self._streaming:
            self._reply(as_dict(snapshot, self._controller.reason))

    def _answer(self, line: bytes) -> dict:
        try:
            request = json.loads(line)
            command = request["command"]
            if command == "stream":
                self._streaming = True
                return self._state()
            return self._commands[command](request)
        except (ValueError, KeyError, TypeError) as err:
            return {"error": f"{line.decode('utf-8', 'replace')!r:.200}: {err!r}"}

    def _reply(self, reply: dict) -> None:
        self._connection.send(json.dumps(reply).encode() + b"\n")

    def _state(self) -> dict:
        return as_dict(self._controller.snapshot, self._controller.reason)

    def _force(self, request: dict) -> dict:
        return _done(self._controller.force.press(_six(request["value"])))

    def _protective_stop(self, _: dict) -> dict:
        return _done(self._controller.protective_stop("asked for at the admin port"))


def as_dict(snapshot: Snapshot, reason: str) -> dict[str, Any]:
    """The state as the admin port tells it; `reason` of the last stop."""
    return {
        "time": snapshot.time,
        "pose": snapshot.pose,
        "speed": snapshot.velocity,
        "joints": snapshot.joints,
        "at_rest": snapshot.resting,
        "runtime_state": snapshot.runtime_state,
        "safety_bits": snapshot.safety_bits,
        "host": snapshot.host,
        "reason": reason,
    }


def _done(_: None) -> dict:
    return {"ok": True}


def _seconds(request: dict) -> float:
    seconds = float(request["seconds"])
    if not (math.isfinite(seconds) and seconds >= 0.0):
        raise ValueError(f"seconds must be finite and not negative, got {seconds}")
    return seconds


def _six(values: Any) -> tuple[float, ...]:
    numbers = tuple(float(value) for value in values)
    if len(numbers) != 6 or not all(math.isfinite(value) for value in numbers):
        raise ValueError(f"six finite numbers are needed, got {values!r:.100}")
    return numbers
