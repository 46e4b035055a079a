"""Protocols of robots, by capability; each driver is a file of its own."""

import math
from abc import abstractmethod
from typing import Literal, NamedTuple, Protocol

import numpy as np

from .rig import Rig

Six = tuple[float, float, float, float, float, float]
Tool = Literal["stirring", "pouring"]
"""What the gripper holds: the stick or the source."""

WATCHDOG_PERIOD = 0.1  # s, after the last set-point, in which a controller stops its arm by itself
LOOKAHEAD = 0.1  # s, by about which an arm lags its set-points


class ArmState(NamedTuple):
    """State of the arm by its controller.

    Attributes:
        time: The controller's clock [s].
        pose: Tool's centre in the base frame: position [m], rotation vector [rad].
        velocity: Of it [m/s, rad/s].
        wrench: On it, in the base frame [N, Nm].
        joints: [rad].
        robot_mode: 7 while it runs.
        runtime_state: 2 while its program runs.
        safety_bits: Bit 0 normal, bit 1 reduced, others a stop.
        speed_scaling: At which the controller carries out motions, 1 at full speed.
        speed_slider: At which the operator let it, 1 at full speed.
        connected: Whether all connections have been there since the start.
    """

    time: float
    pose: Six
    velocity: Six
    wrench: Six
    joints: Six
    robot_mode: int
    runtime_state: int
    safety_bits: int
    speed_scaling: float
    speed_slider: float
    connected: bool

    @property
    def speed(self) -> float:
        """Speed of the tool's centre [m/s]."""
        return math.hypot(*self.velocity[:3])


class Payload(NamedTuple):
    """Payload on the flange by the controller.

    Attributes:
        mass: [kg].
        centre: In the flange's frame [m].
    """

    mass: float
    centre: tuple[float, float, float]


class ArmReader(Protocol):
    """Reads where the arm is, and can do nothing else."""

    @abstractmethod
    def connect(self) -> None:
        """Open the connection.

        Raises:
            RigError: There is no controller, or it refuses.
        """

    @abstractmethod
    def read(self) -> ArmState:
        """The latest state; never waits."""

    @abstractmethod
    def time(self) -> float:
        """Controller's clock of the latest state [s]; a look for whether there is a new one."""

    @abstractmethod
    def payload(self) -> Payload:
        """Payload on the flange by the controller."""

    @abstractmethod
    def close(self) -> None:
        """Let the connection go; harmless when repeated."""


class PathFollower(ArmReader, Protocol):
    """Follows set-points, one a period, and refuses those that break its limits."""

    @abstractmethod
    def take_control(self) -> None:
        """After `connect`: become the one that commands the arm; nothing moves by that.

        Raises:
            RigError: The controller refuses.
            LinkLost: It did not take the tool's centre or the payload.
        """

    @abstractmethod
    def tcp(self) -> Six:
        """Tool's centre in the flange's frame [m, rad]; waits for the controller's answer."""

    @abstractmethod
    def allows(self, pose: np.ndarray) -> bool:
        """Whether the controller's own safety limits allow a pose; waits for its answer."""

    @abstractmethod
    def arm_watchdog(self) -> None:
        """Make the controller stop the arm when set-points cease."""

    @abstractmethod
    def command(self, pose: np.ndarray) -> None:
        """Go to a pose in the base frame, shape (6,), within one period.

        Raises:
            MotionRejected: It breaks a limit; nothing was sent.
            LinkLost: The controller did not take it.
        """

    @abstractmethod
    def stop(self) -> None:
        """Bring the arm to rest and take no further command; returns at once."""

    @abstractmethod
    def give_up(self) -> None:
        """End the controller's program, on an arm at rest; waits for it, but not for ever."""


class Controller(Protocol):
    """Opens its arm in the process that commands it, and can be sent there."""

    @property
    @abstractmethod
    def address(self) -> str:
        """By which a person knows it."""

    @abstractmethod
    def reader(self, rig: Rig) -> ArmReader:
        """The arm to look at, not connected yet."""

    @abstractmethod
    def follower(self, rig: Rig, tool: Tool) -> PathFollower:
        """The arm to command with a tool in its gripper, not connected yet."""


class LinkLost(RuntimeError):
    """The controller cannot be commanded any more; where its arm is going is not known."""
