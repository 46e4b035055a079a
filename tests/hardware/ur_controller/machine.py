"""What a command of the control script acts on: the controller, and the script that runs."""

from typing import Literal, Protocol

from bolfi_liquids.hardware.motion.poses import Numbers

from .moves import Plan
from .queued_arm import QueuedArm
from .registers import Registers
from .script import Script, Waypoint

Thread = Literal["move", "stop", "servo", "speed"]


class ProgramError(Exception):
    """The script fails, as it would on the controller: it ends, and the arm stops."""


class Machine(Protocol):
    """What a script acts on: the controller."""

    arm: QueuedArm
    registers: Registers
    version: tuple[int, int]
    dt: float

    @property
    def steady(self) -> bool: ...
    def zero_force(self) -> None: ...
    def set_payload(self, mass: float, centre: tuple[float, ...]) -> None: ...
    def set_watchdog(self, frequency: float, register: int) -> None: ...
    def protective_stop(self, reason: str) -> None: ...


class RunningScript(Protocol):
    """What a command reads its arguments from, and by which it moves the arm; see `Program`."""

    script: Script
    machine: Machine
    thread: Thread | None
    linear_stop: bool
    speeds_are_linear: bool
    latest: tuple[float, ...]

    @property
    def arm(self) -> QueuedArm: ...
    def number(self, index: int) -> float: ...
    def numbers(self, first: int, count: int = 6) -> list[float]: ...
    def integer(self, index: int) -> int: ...
    def give(self, values: Numbers) -> None: ...
    def give_integer(self, value: int) -> None: ...
    def report(self, progress: int) -> None: ...
    def end_move(self) -> None: ...
    def end_thread(self, thread: Thread) -> None: ...
    def begin(
        self,
        plans: list[Plan],
        thread: Thread | None,
        *,
        brake: float | None = None,
        path: tuple[Waypoint, ...] = (),
    ) -> None: ...
