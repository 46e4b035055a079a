"""ur_rtde's control script at work: reads a command register each tick, answers, owns threads."""

from typing import TYPE_CHECKING, Literal

from bolfi_liquids.hardware.motion.poses import Numbers

from .commands import COMMANDS, REALTIME_COMMANDS, ProgramError
from .moves import Plan
from .queued_arm import QueuedArm
from .registers import Registers
from .script import Script, Waypoint

if TYPE_CHECKING:
    from .controller import Controller

Thread = Literal["move", "stop", "servo", "speed"]
READY, DONE = 1, 2
STOP_SCRIPT = 255
_RUNNING = 1 << 15
_LONGEST = 127


class Program:
    """A running control script.

    The script runs a command to its end before it reads the next one, except that asynchronous
    moves and stops, servo and speed motions go on in a thread of their own. As on the controller
    only one thread may move the arm; a command that wants it beside another is an error, and
    errors end the program.

    Attributes:
        machine: What the script acts on.
        thread: The thread that moves the arm, if one does.
        linear_stop: Whether stopL and stopJ now stop along a line (an asynchronous one was used).
        latest: The real-time command that was carried out last, with its numbers.
    """

    def __init__(self, script: Script, machine: "Controller"):
        self.script = script
        self.machine = machine
        self.thread: Thread | None = None
        self.linear_stop = False
        self.speeds_are_linear = True
        self.latest: tuple[float, ...] = ()
        self._blocked = False
        self._executing = False
        self._path: tuple[Waypoint, ...] = ()
        self._reported = -1
        self._writes = 0
        self._operation = 0
        self.report(-1)
        self._answer(READY)

    @property
    def registers(self) -> Registers:
        return self.machine.registers

    @property
    def arm(self) -> QueuedArm:
        return self.machine.arm

    def tick(self) -> bool:
        """Go on; False once the program has ended.

        Raises:
            ProgramError: The script fails; the controller ends it.
            MotionError: A motion is impossible; the controller makes a protective stop.
        """
        self._watch_path()
        if self._blocked:
            if not self.arm.busy:
                self._blocked = False
                self._answer(DONE)
            return True
        if self.thread in ("move", "stop") and not self.arm.busy:
            self.thread = None
            self.report(-1)
        return self._read_command()

    def _read_command(self) -> bool:
        command = self.registers.integer(self.script.offset)
        if command == 0:
            self._executing = False
            self._answer(READY)
        elif command in REALTIME_COMMANDS:
            self._carry_out(command)
            self._answer(READY)
        elif not self._executing:
            if command == STOP_SCRIPT:
                return False
            self._carry_out(command)
            self._executing = True
            if not self._blocked:
                self._answer(DONE)
        return True

    def _carry_out(self, command: int) -> None:
        if command not in COMMANDS:
            raise ProgramError(f"command {command} is not emulated")
        COMMANDS[command](self)

    def _answer(self, value: int) -> None:
        self.registers.output_ints[self.script.offset] = value

    def number(self, index: int) -> float:
        return self.numbers(index, 1)[0]

    def numbers(self, first: int, count: int = 6) -> list[float]:
        return self.registers.doubles(self.script.offset + first, count)

    def integer(self, index: int) -> int:
        return self.registers.integer(self.script.offset + index)

    def give(self, values: Numbers) -> None:
        """Result of a command, one number or six."""
        for index, value in enumerate(values, self.script.offset):
            self.registers.output_doubles[index] = float(value)

    def give_integer(self, value: int) -> None:
        self.registers.output_ints[self.script.offset + 1] = int(value)

    def report(self, progress: int) -> None:
        """Write the progress register: 0 begins a new operation, a negative number ends it."""
        self._writes = 0 if self._writes >= _LONGEST else self._writes + 1
        if progress == 0:
            self._operation = 0 if self._operation >= _LONGEST else self._operation + 1
        value = (self._writes << 16) + (self._operation << 24)
        if progress >= 0:
            value += _RUNNING + min(progress, _RUNNING - 1)
        self.registers.output_ints[self.script.offset + 2] = value

    def end_move(self) -> None:
        """Kill the thread of an asynchronous move; the arm brakes when something else begins."""
        self._path = ()
        if self.thread == "move":
            self.thread = None
            self.report(-1)

    def end_thread(self, thread: Thread) -> None:
        """Kill a thread of the script, if it runs."""
        if self.thread == thread:
            self.thread = None
        self.latest = ()

    def begin(
        self,
        plans: list[Plan],
        thread: Thread | None,
        *,
        brake: float | None = None,
        path: tuple[Waypoint, ...] = (),
    ) -> None:
        """Move the arm in a thread, or with None in the script itself, which then waits.

        Args:
            plans: Motions, one after the other.
            thread: Who moves the arm.
            brake: The arm comes to rest first, at this rate [rad/s2]; None: goes on from its speed.
            path: Waypoints whose progress is reported, one for each plan.

        Raises:
            ProgramError: Another thread moves the arm.
        """
        if self.thread not in (None, thread):
            raise ProgramError(f"the {self.thread} thread is already controlling the robot")
        self._path, self._reported = path, -1
        self.arm.begin(plans, brake=brake)
        self.thread = thread
        self._blocked = thread is None
        if thread in ("move", "stop"):
            self.report(0)

    def _watch_path(self) -> None:
        """Report the waypoints that the arm has set out for."""
        while self._path and self._reported < min(self.arm.index, len(self._path) - 1):
            self._reported += 1
            progress = self._path[self._reported].progress
            if progress is not None:
                self.report(progress)
