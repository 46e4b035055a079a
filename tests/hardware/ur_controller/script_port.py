"""Upload of scripts, port 30003. What the real port streams, ur_rtde never reads."""

from .controller import Controller
from .network import Connection
from .program import take_script

MAX_SCRIPT_SIZE = 1 << 20  # bytes; a script without an end


class ScriptSession:
    """One client that sends scripts."""

    def __init__(self, connection: Connection, controller: Controller):
        self._connection = connection
        self._controller = controller

    def received(self) -> None:
        while (text := take_script(self._connection.inbox)) is not None:
            self._controller.load(text)
        if len(self._connection.inbox) > MAX_SCRIPT_SIZE:
            self._connection.closing = True
