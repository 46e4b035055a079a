"""What the rendered cameras look at: where the gripper is and how the stick hangs."""

from typing import NamedTuple, Protocol

import numpy as np


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
