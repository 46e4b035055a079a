"""The controller: ur_rtde's control script, safety and arm, one tick after the other.

It answers ur_rtde's real client as a UR controller does, in all that our driver asks of it:
registers, recipes, set-points, tool and payload, watchdog, protective stop. Its arm is that of the
emulated rig. Not emulated: forces and inertia of the arm, payload errors, the real servo filter (an
assumed one stands for it), safety planes, other motions, other scripts than ur_rtde's. Passing here
is no acceptance test of a robot.
"""

import random
import re
import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from bolfi_liquids.hardware.emulated.arm import (
    FORCE_NOISE,
    PROTECTIVE_BITS,
    PROTECTIVE_STOP,
    STOPPED,
)
from bolfi_liquids.hardware.emulated.motion import KinematicArm, MotionError
from bolfi_liquids.hardware.motion.kinematics import ARMS
from bolfi_liquids.hardware.process import REAL_CLOCK, HostClock
from bolfi_liquids.hardware.safety.guards import NORMAL, PLAYING

MODELS = {  # software's version, ticks per second, version as the dashboard tells it
    "cb3": ((3, 15, 8, 106339), 125.0, "URSoftware 3.15.8.106339 (Nov 05 2021)"),
    "e-series": ((5, 11, 6, 108000), 500.0, "URSoftware 5.11.6.108000 (Nov 10 2021)"),
}
PROGRAM_STOP = 3.0  # m/s2 and rad/s2, when a program ends in motion
REGISTERS = 48  # of each kind: the mailbox between client and script
READY, DONE = 1, 2
SERVO_STOP, SET_PAYLOAD, SERVO_L, SET_TCP = 16, 17, 24, 29
SET_WATCHDOG, WITHIN_LIMITS, TCP_OFFSET, STOP_SCRIPT = 35, 36, 40, 255
OFFSET = re.compile(r"# int register offset\n\s*(\d+)")


class Options(NamedTuple):
    """How the emulator is set up.

    Attributes:
        controller: Key of `MODELS` and of `kinematics.ARMS`.
        joints: At the start [rad]; elbow up, tool pointing down, in front of the base.
        tcp: The tool's centre in the flange's frame, as its installation has it [m, rad].
        seed: Of the force's noise.
    """

    controller: str = "cb3"
    joints: tuple[float, ...] = (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0)
    tcp: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    seed: int = 0


class Snapshot(NamedTuple):
    """What the controller knows at one tick, as plain numbers; SI units, base frame."""

    time: float
    host: float
    joints: tuple[float, ...]
    pose: tuple[float, ...]
    velocity: tuple[float, ...]
    force: tuple[float, ...]
    runtime_state: int
    safety_bits: int
    payload: float
    payload_centre: tuple[float, ...]
    output_ints: tuple[int, ...]
    output_doubles: tuple[float, ...]
    resting: bool


class ScriptError(Exception):
    """The script fails, as it would on the controller: it ends, and the arm stops."""


class Controller:
    """State of the emulated controller; servers read and write it between ticks.

    Attributes:
        pressed: Force [N] and torque [Nm] with which somebody presses at the TCP.
        reason: Why the program stopped last; empty if it never did.
        started: How often the arm began to move.
    """

    def __init__(self, options: Options, clock: HostClock = REAL_CLOCK):
        self.clock = clock
        self.version, self.rate, self.dated = MODELS[options.controller]
        self.dt = 1.0 / self.rate
        self.inputs: dict[str, float] = {}
        self.output_ints, self.output_doubles = [0] * REGISTERS, [0.0] * REGISTERS
        self.arm = KinematicArm(
            ARMS[options.controller], np.array(options.joints), np.array(options.tcp)
        )
        self.pressed: tuple[float, ...] = (0.0,) * 6
        self.payload: tuple[float, tuple[float, ...]] = (0.0, (0.0, 0.0, 0.0))
        self.reason, self.started = "", 0
        self._noise = random.Random(options.seed)
        self._program: Program | None = None
        self._protective = False
        self._watchdog: tuple[str, float] | None = None  # a register, and its period [s]
        self._kicked = self._ticks = 0
        self.snapshot = self._look()

    def load(self, script: str) -> None:
        """Start an uploaded script, instead of the one that runs."""
        self.end_program("replaced by another script")
        if (found := OFFSET.search(script)) is None or self._protective:
            self._note("a protective stop, or a script that is not ur_rtde's: it does not start")
        else:
            self._program = Program(self, int(found[1]))

    def end_program(self, reason: str, deceleration: float = PROGRAM_STOP) -> None:
        """Stop the program; the arm comes to rest."""
        if self._program is not None:
            self._note(f"program stopped: {reason}")
            self._program = self._watchdog = None
            self.arm.stop(deceleration)

    def protective_stop(self, reason: str) -> None:
        self.end_program(reason)
        self._protective = True
        self._note(f"protective stop: {reason}")
        self.arm.stop(PROTECTIVE_STOP)

    def receive(self, values: dict[str, float]) -> None:
        """Data package of a client; a write of its register kicks the watchdog."""
        self.inputs.update(values)
        if self._watchdog is not None and self._watchdog[0] in values:
            self._kicked = self._ticks

    def set_watchdog(self, frequency: float, register: int) -> None:
        """End the program when a register is not written for a period."""
        armed = (f"input_int_register_{register}", 1.0 / frequency) if frequency > 0.0 else None
        self._watchdog, self._kicked = armed, self._ticks

    def mount(self, tcp: np.ndarray) -> None:
        """Give the arm, at rest, another tool's centre in the flange's frame."""
        self.arm = KinematicArm(self.arm.model, self.arm.state.joints, tcp)

    def skip(self, ticks: int) -> None:
        """Let the clock go on by ticks that the computer had no time for, nor who should kick."""
        self._ticks += ticks
        self._kicked += ticks

    def tick(self) -> Snapshot:
        """One period: watchdog, program, arm."""
        self._ticks += 1
        if self._watchdog is not None:
            register, period = self._watchdog
            if (self._ticks - self._kicked) * self.dt > period + 0.5 * self.dt:
                self.end_program(f"watchdog: {register} not written for {period:.3f} s")
        rested = self.arm.resting
        try:
            if self._program is not None and not self._program.tick():
                self.end_program("it ended")
            self.arm.tick(self.dt)
        except ScriptError as err:
            self.end_program(f"error: {err}")
        except MotionError as err:
            self.protective_stop(str(err))
        self.started += rested and not self.arm.resting
        self.snapshot = self._look()
        return self.snapshot

    def _look(self) -> Snapshot:
        arm = self.arm
        noise = [self._noise.gauss(0.0, sd) for sd in FORCE_NOISE]
        return Snapshot(
            time=self._ticks * self.dt,
            host=self.clock.now(),
            joints=tuple(arm.state.joints.tolist()),
            pose=tuple(arm.pose.tolist()),
            velocity=tuple(arm.velocity.tolist()),
            force=tuple(map(sum, zip(self.pressed, noise, strict=True))),
            runtime_state=STOPPED if self._program is None else PLAYING,
            safety_bits=PROTECTIVE_BITS if self._protective else NORMAL,
            payload=self.payload[0],
            payload_centre=self.payload[1],
            output_ints=tuple(self.output_ints),
            output_doubles=tuple(self.output_doubles),
            resting=arm.resting,
        )

    def _note(self, text: str) -> None:
        self.reason = text
        print(f"emulator: {text}", file=sys.stderr, flush=True)


class Program:
    """A running control script: it reads a command register each tick, carries it out, answers.

    It runs a command to its end before it reads the next one, except that the arm goes on to a
    set-point by itself. Emulated are the commands that our driver gives; any other is an error.
    """

    def __init__(self, machine: Controller, offset: int):
        self._machine, self._offset = machine, offset
        self._set_point: list[float] = []
        self._executing = self._stopping = False
        self._commands: dict[int, Callable[[], None]] = {
            SERVO_STOP: self._servo_stop,
            SET_PAYLOAD: self._set_payload,
            SET_TCP: lambda: machine.mount(np.array(self._numbers(6))),
            SET_WATCHDOG: lambda: machine.set_watchdog(self._numbers(1)[0], offset),
            WITHIN_LIMITS: self._tell_reach,
            TCP_OFFSET: self._tell_tcp,
        }
        self._answer(READY)

    def tick(self) -> bool:
        """Go on; False once the program has ended.

        Raises:
            ScriptError: The script fails; the controller ends it.
            MotionError: A motion is impossible; the controller makes a protective stop.
        """
        if self._stopping:
            if self._machine.arm.resting:
                self._stopping = False
                self._answer(DONE)
            return True
        command = int(self._machine.inputs.get(f"input_int_register_{self._offset}", 0))
        if command == STOP_SCRIPT and not self._executing:
            return False
        if command == 0:
            self._executing = False
            self._answer(READY)
        elif command == SERVO_L:
            self._servo()
            self._answer(READY)
        elif not self._executing:
            if command not in self._commands:
                raise ScriptError(f"command {command} is not emulated")
            self._commands[command]()
            self._executing = True
            if not self._stopping:
                self._answer(DONE)
        return True

    def _servo(self) -> None:
        """Whenever the script reads a set-point; the arm goes on to one that stays what it was."""
        numbers, arm = self._numbers(11), self._machine.arm
        if numbers != self._set_point:
            self._set_point = numbers
            *pose, _, _, _, arm.lookahead, arm.gain = numbers
            arm.follow(np.array(pose))

    def _servo_stop(self) -> None:
        self._set_point, self._stopping = [], True
        self._machine.arm.stop(self._numbers(1)[0])

    def _set_payload(self) -> None:
        mass, *centre = self._numbers(4)
        self._machine.payload = (mass, tuple(centre))

    def _tell_reach(self) -> None:
        reached = self._machine.arm.reaches(np.array(self._numbers(6)))
        self._machine.output_ints[self._offset + 1] = int(reached)

    def _tell_tcp(self) -> None:
        self._machine.output_doubles[self._offset : self._offset + 6] = (
            self._machine.arm.tcp.tolist()
        )

    def _numbers(self, count: int) -> list[float]:
        names = (f"input_double_register_{self._offset + i}" for i in range(count))
        return [float(self._machine.inputs.get(name, 0.0)) for name in names]

    def _answer(self, value: int) -> None:
        self._machine.output_ints[self._offset] = value
