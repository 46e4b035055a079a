"""What the rendered cameras look at: where the gripper is and how the stick hangs."""

from collections.abc import Callable
from dataclasses import dataclass
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


@dataclass(frozen=True)
class MovingWorld:
    """A motion given by formulae.

    Attributes:
        pivot: Position [m], shape (3,), at a time of the robot's clock [s].
        inclination: Of the stick [rad], shape (2,), at a time of the robot's clock [s].
        offset: Robot's clock minus this computer's [s].
    """

    pivot: Callable[[float], np.ndarray]
    inclination: Callable[[float], np.ndarray]
    offset: float = 0.0

    def state(self, host: float) -> WorldState:
        """The scene at a time of this computer's clock [s]."""
        time = host + self.offset
        return WorldState(time, self.pivot(time), self.inclination(time))


def direction(inclination: np.ndarray) -> np.ndarray:
    """Unit vector from the pivot down the stick, from its two inclinations [rad]; shape (3,)."""
    x, y = np.tan(inclination)
    return np.array([x, y, -1.0]) / np.sqrt(1.0 + x * x + y * y)
