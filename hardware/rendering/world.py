"""The scene before rendered cameras: where the gripper is and how the stick hangs.

In shared memory one process moves it, and cameras in other processes look at it. As on the board, a
number is one aligned double and nobody waits: whoever looks leaves out the rows that may be in the
making.
"""

from ctypes import c_double, c_longlong
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..board import SPAWN

ROWS = 1024  # 2 s at the fastest controller's 500 Hz
WIDTH = 7  # host time, robot's time, pivot, inclination


class WorldState(NamedTuple):
    """The scene at one moment.

    Attributes:
        time: On the robot's clock [s].
        pivot: Of the stick, in the cup frame [m], shape (3,).
        inclination: From the downward vertical in the xz and yz planes [rad], shape (2,).
    """

    time: float
    pivot: np.ndarray
    inclination: np.ndarray


class World(Protocol):
    """Knows the scene at any recent moment."""

    def state(self, host: float) -> WorldState:
        """The scene at a time of this computer's clock [s]."""
        ...


def direction(inclination: np.ndarray) -> np.ndarray:
    """Unit vector from the pivot down the stick, from its two inclinations [rad]; shape (3,)."""
    x, y = np.tan(inclination)
    return np.array([x, y, -1.0]) / np.sqrt(1.0 + x * x + y * y)


class SharedWorld:
    """The latest states; it may be given to spawned processes as an argument.

    Args:
        host: Host time [s] of its first state.
        state: How it is until somebody moves it.
    """

    def __init__(self, host: float, state: WorldState):
        self._memory: Any = SPAWN.RawArray(c_double, ROWS * WIDTH)
        self._written: Any = SPAWN.RawValue(c_longlong, 0)
        self.write(host, state)

    def write(self, host: float, state: WorldState) -> None:
        """Add a state at a later host time [s]; for the process alone that moves the world."""
        at = WIDTH * (self._written.value % ROWS)
        self._memory[at : at + WIDTH] = [host, state.time, *state.pivot, *state.inclination]
        # the count goes last: a row that it counts is whole
        self._written.value += 1

    def state(self, host: float) -> WorldState:
        """The scene at a host time [s], between the two states around it; the last one stays."""
        while True:
            end = self._written.value
            rows = np.frombuffer(self._memory).reshape(ROWS, WIDTH).copy()
            first = max(self._written.value - ROWS + 1, 0)
            if first < end:  # always, unless this process stood still for seconds in between
                break
        times, *columns = rows[np.arange(first, end) % ROWS].T
        time, *place = (float(np.interp(host, times, column)) for column in columns)
        return WorldState(time, np.array(place[:3]), np.array(place[3:]))
