"""ur_rtde's control script at work: reads a command register each tick, carries it out, answers.

Emulated are the script's upload and the commands that our driver gives; any other is an error.
"""

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from bolfi_liquids.hardware.emulated.motion import KinematicArm

from .registers import Registers

if TYPE_CHECKING:
    from .controller import Controller

READY, DONE = 1, 2
SERVO_STOP, SET_PAYLOAD, SERVO_L, SET_TCP = 16, 17, 24, 29
SET_WATCHDOG, WITHIN_LIMITS, TCP_OFFSET, STOP_SCRIPT = 35, 36, 40, 255
_OFFSET = re.compile(r"# int register offset\n\s*(\d+)")
_END = re.compile(rb"^end[ \t\r]*\n", re.MULTILINE)


class ScriptError(ValueError):
    """The script is not one that the emulator knows."""


class ProgramError(Exception):
    """The script fails, as it would on the controller: it ends, and the arm stops."""


def take_script(buffer: bytearray) -> str | None:
    """Remove the first whole script from `buffer`: it ends with `end` at the line's start."""
    found = _END.search(buffer)
    if found is None:
        return None
    text = bytes(buffer[: found.end()]).decode("utf-8", "replace")
    del buffer[: found.end()]
    return text


class Program:
    """A running control script.

    The script runs a command to its end before it reads the next one, except that the arm goes on
    to a set-point by itself. Errors end the program.

    Raises:
        ScriptError: The script is not ur_rtde's control script.
    """

    def __init__(self, script: str, machine: "Controller"):
        found = _OFFSET.search(script)
        if found is None:
            first = script.strip().splitlines()[:1]
            raise ScriptError(f"only ur_rtde's control script is emulated, not {first}")
        self._offset = int(found[1])
        self._machine = machine
        self._set_point: list[float] = []
        self._executing = False
        self._stopping = False
        self._commands: dict[int, Callable[[], None]] = {
            SERVO_STOP: self._servo_stop,
            SET_PAYLOAD: self._set_payload,
            SET_TCP: self._set_tcp,
            SET_WATCHDOG: lambda: machine.set_watchdog(self._numbers(1)[0], self._offset),
            WITHIN_LIMITS: lambda: self._give_integer(self._arm.reaches(self._pose())),
            TCP_OFFSET: lambda: self._give(self._arm.tcp),
        }
        self._answer(READY)

    def tick(self) -> bool:
        """Go on; False once the program has ended.

        Raises:
            ProgramError: The script fails; the controller ends it.
            MotionError: A motion is impossible; the controller makes a protective stop.
        """
        if self._stopping:
            if self._arm.resting:
                self._stopping = False
                self._answer(DONE)
            return True
        command = self._registers.integer(self._offset)
        if command == 0:
            self._executing = False
            self._answer(READY)
        elif command == SERVO_L:
            self._servo()
            self._answer(READY)
        elif not self._executing:
            if command == STOP_SCRIPT:
                return False
            self._carry_out(command)
        return True

    def _carry_out(self, command: int) -> None:
        if command not in self._commands:
            raise ProgramError(f"command {command} is not emulated")
        self._commands[command]()
        self._executing = True
        if not self._stopping:
            self._answer(DONE)

    def _servo(self) -> None:
        """Whenever the script reads a set-point; the arm goes on to one that stays what it was."""
        numbers = self._numbers(11)
        if numbers != self._set_point:
            self._set_point = numbers
            *pose, _, _, _, self._arm.lookahead, self._arm.gain = numbers
            self._arm.follow(np.array(pose))

    def _servo_stop(self) -> None:
        self._set_point, self._stopping = [], True
        self._arm.stop(self._numbers(1)[0])

    def _set_payload(self) -> None:
        mass, *centre = self._numbers(4)
        self._machine.set_payload(mass, tuple(centre))

    def _set_tcp(self) -> None:
        offset = self._pose()
        if not np.isfinite(offset).all():
            raise ProgramError(f"TCP offset {offset.tolist()} is not finite")
        self._machine.mount(offset)

    @property
    def _arm(self) -> KinematicArm:
        return self._machine.arm

    @property
    def _registers(self) -> Registers:
        return self._machine.registers

    def _pose(self) -> np.ndarray:
        return np.array(self._numbers(6))

    def _numbers(self, count: int) -> list[float]:
        return self._registers.doubles(self._offset, count)

    def _answer(self, value: int) -> None:
        self._registers.output_ints[self._offset] = value

    def _give(self, values: np.ndarray) -> None:
        """Result of a command, six numbers."""
        for index, value in enumerate(values, self._offset):
            self._registers.output_doubles[index] = float(value)

    def _give_integer(self, value: int) -> None:
        self._registers.output_ints[self._offset + 1] = int(value)
