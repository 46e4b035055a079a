"""Real-Time Data Exchange, port 30004."""

import struct
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from .controller import Controller
from .fields import Recipe, find
from .network import Connection
from .registers import INPUT_TYPES
from .snapshot import Snapshot
from .wire import (
    CONTROLLER,
    DATA,
    INPUTS,
    OUTPUTS,
    PAUSE,
    START,
    VERSION,
    WireError,
    layout,
    names,
    pack,
    take,
)


class Input(NamedTuple):
    """Fields that a client writes together."""

    names: list[str]
    layout: struct.Struct


class RtdeSession:
    """One client: its recipes, and whether it wants data.

    Args:
        connection: Its socket.
        controller: Serves it.
        others: All clients of this port; two of them may not write the same field.
    """

    def __init__(
        self,
        connection: Connection,
        controller: Controller,
        others: Callable[[], list["RtdeSession"]],
    ):
        self._connection = connection
        self._controller = controller
        self._others = others
        self._inputs: list[Input] = []
        self._recipe: Recipe | None = None
        self._started = False
        self._every = 1
        self._waited = 0
        self._delayed: deque[tuple[float, bytes]] = deque()
        self._answers = {
            VERSION: self._negotiate,
            CONTROLLER: self._tell_version,
            OUTPUTS: self._set_up_outputs,
            INPUTS: self._set_up_inputs,
            START: self._start,
            PAUSE: self._pause,
            DATA: self._take_data,
        }

    @property
    def claimed(self) -> set[str]:
        """Fields that this client writes."""
        return {name for one in self._inputs for name in one.names}

    def received(self) -> None:
        try:
            while (package := take(self._connection.inbox)) is not None:
                answer = self._answers.get(package.type)
                if answer is None:
                    raise WireError(f"package type {package.type} is unknown")
                reply = answer(package.payload)
                if reply is not None:
                    self._connection.send(pack(package.type, reply))
        except (WireError, struct.error):
            self._connection.closing = True

    def publish(self, snapshot: Snapshot, delay: float) -> None:
        """One tick: send the data, if this client's turn has come."""
        if self._started and self._recipe is not None:
            self._waited += 1
            if self._waited >= self._every:
                self._waited = 0
                package = pack(DATA, self._recipe.pack(snapshot))
                self._delayed.append((snapshot.host + delay, package))
        now = self._controller.clock.now()
        while self._delayed and self._delayed[0][0] <= now:
            self._connection.send(self._delayed.popleft()[1])

    def miss(self) -> None:
        """One tick of a frozen link."""
        self._delayed.clear()

    def _negotiate(self, payload: bytes) -> bytes:
        (version,) = struct.unpack(">H", payload)
        return bytes([version == 2])

    def _tell_version(self, _: bytes) -> bytes:
        return struct.pack(">4I", *self._controller.model.version)

    def _set_up_outputs(self, payload: bytes) -> bytes:
        (frequency,) = struct.unpack_from(">d", payload)
        wanted = names(payload[8:])
        fields = [find(name, self._controller.version) for name in wanted]
        types = ["NOT_FOUND" if field is None else field.type for field in fields]
        known = [field for field in fields if field is not None]
        self._recipe = Recipe(known) if len(known) == len(fields) else None
        # the controller divides its rate by a whole number
        rate = self._controller.rate
        self._every = max(1, int(rate / frequency + 1e-9)) if frequency > 0.0 else 1
        return bytes([self._recipe is not None]) + ",".join(types).encode()

    def _set_up_inputs(self, payload: bytes) -> bytes:
        wanted = names(payload)
        taken = {name for other in self._others() if other is not self for name in other.claimed}
        types = [
            "IN_USE" if name in taken else INPUT_TYPES.get(name, "NOT_FOUND") for name in wanted
        ]
        if not {"IN_USE", "NOT_FOUND"}.isdisjoint(types):
            return bytes([0]) + ",".join(types).encode()
        self._inputs.append(Input(wanted, layout(types)))
        return bytes([len(self._inputs)]) + ",".join(types).encode()

    def _start(self, _: bytes) -> bytes:
        self._started = self._recipe is not None
        return bytes([self._started])

    def _pause(self, _: bytes) -> bytes:
        self._started = False
        return bytes([1])

    def _take_data(self, payload: bytes) -> None:
        number = payload[0] if payload else 0
        if not 1 <= number <= len(self._inputs):
            raise WireError(f"input recipe {number} was never set up")
        recipe = self._inputs[number - 1]
        # ur_rtde sends more than the recipe holds now and then; the controller reads what it needs
        _, *values = recipe.layout.unpack_from(payload)
        flat = iter(values)
        self._controller.receive(
            {
                name: next(flat)
                for name in recipe.names
                if INPUT_TYPES[name] != "VECTOR6D" or not [next(flat) for _ in range(6)]
            }
        )
