"""Dashboard server, port 29999: lines of text, a line for each."""

from collections.abc import Callable

from .controller import Controller
from .network import Connection

TOO_EARLY = (
    "Cannot unlock protective stop until 5s after occurrence. "
    "Always inspect cause of protective stop before unlocking"
)


class DashboardSession:
    """One client. No program file is installed, so that nothing can be played."""

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
            if line.strip().lower() == b"quit":
                self._connection.closing = True

    def _send(self, line: str) -> None:
        self._connection.send(line.encode() + b"\n")


def answer(controller: Controller, line: str) -> str:
    """Reply to one command."""
    command = line.lower()
    for start, reply in _ANSWERS.items():
        if command == start or command.startswith(start + " "):
            return reply(controller, line[len(start) :].strip())
    return f'could not understand: "{line}"'


def _stop(controller: Controller, _: str) -> str:
    controller.end_program("stopped at the dashboard")
    return "Stopped"


def _unlock(controller: Controller, _: str) -> str:
    return "Protective stop releasing" if controller.unlock() else TOO_EARLY


def _safety(controller: Controller, title: str) -> str:
    return f"{title}: {'PROTECTIVE_STOP' if controller.protective else 'NORMAL'}"


def _running(controller: Controller) -> bool:
    return controller.program is not None


def _text(reply: str) -> Callable[[Controller, str], str]:
    return lambda controller, argument: reply.format(argument)


_ANSWERS: dict[str, Callable[[Controller, str], str]] = {
    "polyscopeversion": lambda c, _: c.model.dated,
    "get serial number": _text("20210000000"),
    "get robot model": lambda c, _: c.arm.mounted.arm.name.removesuffix("e"),
    "is in remote control": _text("true"),
    "robotmode": _text("Robotmode: RUNNING"),
    "safetymode": lambda c, _: _safety(c, "Safetymode"),
    "safetystatus": lambda c, _: _safety(c, "Safetystatus"),
    "programstate": lambda c, _: ("PLAYING" if _running(c) else "STOPPED") + " <unnamed>",
    "running": lambda c, _: f"Program running: {str(_running(c)).lower()}",
    "stop": _stop,
    "unlock protective stop": _unlock,
    "play": _text("Failed to execute: play"),
    "pause": _text("Failed to execute: pause"),
    "load": _text("File not found: {}"),
    "get loaded program": _text("No program loaded"),
    "isprogramsaved": _text("true <unnamed>"),
    "power on": _text("Powering on"),
    "power off": _text("Failed to execute: power off"),
    "brake release": _text("Brake releasing"),
    "close safety popup": _text("closing safety popup"),
    "close popup": _text("closing popup"),
    "popup": _text("showing popup"),
    "addtolog": _text("Added log message"),
    "restart safety": _text("Restarting safety"),
    "setuserrole": _text("Setting user role: {}"),
    "shutdown": _text("Failed to execute: shutdown"),
    "quit": _text("Disconnected"),
}
