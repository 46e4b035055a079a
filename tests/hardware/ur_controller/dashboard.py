"""Dashboard server, port 29999: lines of text, a line for each."""

from collections.abc import Callable

from .controller import Controller
from .network import Connection

TOO_EARLY = (
    "Cannot unlock protective stop until 5s after occurrence. "
    "Always inspect cause of protective stop before unlocking"
)


class DashboardSession:
    """One client; what ur_rtde asks when it connects, and what a person does at the panel."""

    def __init__(self, connection: Connection, controller: Controller):
        self._connection = connection
        self._controller = controller
        self._send("Connected: Universal Robots Dashboard Server")

    def received(self) -> None:
        inbox = self._connection.inbox
        while b"\n" in inbox:
            line, _, rest = bytes(inbox).partition(b"\n")
            inbox[:] = rest
            self._send(answer(self._controller, line.decode("utf-8", "replace").strip()))

    def _send(self, line: str) -> None:
        self._connection.send(line.encode() + b"\n")


def answer(controller: Controller, line: str) -> str:
    """Reply to one command."""
    reply = _ANSWERS.get(line.lower())
    return f'could not understand: "{line}"' if reply is None else reply(controller)


_ANSWERS: dict[str, Callable[[Controller], str]] = {
    "polyscopeversion": lambda one: one.model.dated,
    "get serial number": lambda _: "20210000000",
    "is in remote control": lambda _: "true",
    "safetymode": lambda one: f"Safetymode: {'PROTECTIVE_STOP' if one.protective else 'NORMAL'}",
    "unlock protective stop": lambda one: (
        "Protective stop releasing" if one.unlock() else TOO_EARLY
    ),
}
