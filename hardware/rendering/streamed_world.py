"""The world as an emulated robot tells it: its admin port's stream of states."""

import json
import socket
import threading
from collections import deque
from dataclasses import dataclass
from typing import IO, Any

import numpy as np

from .world import WorldState

KEPT_SECONDS = 1.0  # s
ADMIN_PORT = 29997


class WorldError(RuntimeError):
    """The stream of states cannot be used."""


@dataclass(frozen=True)
class CupPlace:
    """Where the cup stands before the robot.

    Attributes:
        position: Of the cup's origin in the base frame [m].
        yaw: From the base's axes to the cup's, about z [rad].
    """

    position: tuple[float, float, float]
    yaw: float = 0.0

    def pivot(self, base: np.ndarray) -> np.ndarray:
        """A point of the base frame in the cup frame [m], shape (3,)."""
        x, y, z = np.asarray(base) - self.position
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([cos * x + sin * y, cos * y - sin * x, z])

    def inclination(self, base: np.ndarray) -> np.ndarray:
        """Inclinations [rad] in planes along the base's axes, in planes along the cup's."""
        x, y = np.tan(base)
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.arctan([cos * x + sin * y, cos * y - sin * x])


class StreamedWorld:
    """Listens to the emulator; keeps the last second. When the stream ends the last state stays."""

    def __init__(self, host: str, place: CupPlace, *, port: int = ADMIN_PORT, timeout: float = 5.0):
        """Connect and wait for the first state.

        Args:
            host: Address of the emulator.
            place: Where the cup stands.
            port: Of its admin stream.
            timeout: For connection and first state [s].

        Raises:
            WorldError: no emulator answers, or it sends no state.
        """
        self._place = place
        self._states: deque[tuple[float, WorldState]] = deque()
        self._lock = threading.Lock()
        self._first = threading.Event()
        try:
            self._socket = socket.create_connection((host, port), timeout)
        except OSError as err:
            raise WorldError(
                f"no emulator answers on {host}:{port} ({err}); start it before the cameras"
            ) from err
        self._socket.settimeout(None)
        self._socket.sendall(b'{"command":"stream"}\n')
        self._thread = threading.Thread(target=self._listen, daemon=True, name=f"world {host}")
        self._thread.start()
        if not self._first.wait(timeout) or not self._states:
            self.close()
            raise WorldError(f"the emulator on {host}:{port} sent no state within {timeout} s")

    def state(self, host: float) -> WorldState:
        """The scene at a time of this computer's clock [s], between the two states around it."""
        with self._lock:
            states = list(self._states)
        times = [time for time, _ in states]
        after = int(np.searchsorted(times, host))
        if after == 0 or after == len(states):
            return states[min(after, len(states) - 1)][1]
        (t0, a), (t1, b) = states[after - 1], states[after]
        w = (host - t0) / (t1 - t0)
        return WorldState(
            a.time + w * (b.time - a.time),
            a.pivot + w * (b.pivot - a.pivot),
            a.inclination + w * (b.inclination - a.inclination),
        )

    def close(self) -> None:
        """Stop to listen; harmless when repeated."""
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # the emulator has closed it already
        self._thread.join(1.0)
        self._socket.close()

    def _listen(self) -> None:
        try:
            with self._socket.makefile("r", encoding="utf-8") as lines:
                self._keep(lines)
        except OSError:
            pass  # the emulator was killed: the last state stays
        finally:
            self._first.set()

    def _keep(self, lines: IO[str]) -> None:
        for line in lines:
            if not line.endswith("\n"):
                return  # cut off in the middle
            fields = json.loads(line)
            if "pose" not in fields:
                continue
            host, state = self._read(fields)
            with self._lock:
                if self._states and host <= self._states[-1][0]:
                    continue
                self._states.append((host, state))
                while host - self._states[0][0] > KEPT_SECONDS:
                    self._states.popleft()
            self._first.set()

    def _read(self, fields: dict[str, Any]) -> tuple[float, WorldState]:
        return float(fields["host"]), WorldState(
            float(fields["time"]),
            self._place.pivot(np.array(fields["pose"][:3], dtype=float)),
            self._place.inclination(np.array(fields["stick"], dtype=float)),
        )
