"""The controller: program, safety and arm, one tick after the other.

It answers ur_rtde's real client as a UR controller does, in all that our driver asks of it:
registers, recipes, set-points, tool and payload, watchdog, protective stop. Its arm is that of the
emulated rig. Not emulated: forces and inertia of the arm, payload errors, the real servo filter (an
assumed one stands for it), safety planes, other motions, other scripts than ur_rtde's. Passing here
is no acceptance test of a robot.
"""

import sys
from typing import NamedTuple

import numpy as np
from bolfi_liquids.hardware.emulated.arm import PROTECTIVE_BITS, PROTECTIVE_STOP, STOPPED
from bolfi_liquids.hardware.emulated.motion import KinematicArm, MotionError
from bolfi_liquids.hardware.motion.kinematics import ARMS
from bolfi_liquids.hardware.process import REAL_CLOCK, HostClock
from bolfi_liquids.hardware.safety.guards import NORMAL, PLAYING

from .force import ForceReading
from .program import Program, ProgramError, ScriptError
from .registers import Registers
from .snapshot import Snapshot


class Model(NamedTuple):
    """A generation of controllers.

    Attributes:
        version: Of its software: major, minor, bugfix, build.
        rate: Ticks per second.
        dated: The version as the dashboard tells it.
    """

    version: tuple[int, int, int, int]
    rate: float
    dated: str


MODELS = {
    "cb3": Model((3, 15, 8, 106339), 125.0, "URSoftware 3.15.8.106339 (Nov 05 2021)"),
    "e-series": Model((5, 11, 6, 108000), 500.0, "URSoftware 5.11.6.108000 (Nov 10 2021)"),
}
PROGRAM_STOP = 3.0  # m/s2 and rad/s2, when a program ends in motion
# elbow up, tool pointing down, in front of the base
HOME_JOINTS = (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0)


class Watchdog(NamedTuple):
    """Ends the program if `register` is not written for `period` [s] of the controller's clock.

    `kicked` is the tick of the latest write: while the computer that emulates the controller
    stands still, so does whoever should write.
    """

    register: str
    period: float
    kicked: int


class Options(NamedTuple):
    """How the emulator is set up; None leaves the choice to the controller's generation.

    Attributes:
        controller: Key of `MODELS` and of `kinematics.ARMS`.
        joints: At the start [rad].
        tcp: The tool's centre in the flange's frame, as its installation has it [m, rad].
        rate: Ticks per second.
        seed: Of the force's noise.
        unlock_after: A protective stop cannot be unlocked earlier [s].
    """

    controller: str = "cb3"
    joints: tuple[float, ...] = HOME_JOINTS
    tcp: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    rate: float | None = None
    seed: int = 0
    unlock_after: float = 5.0


class Controller:
    """State of the emulated controller; servers read and write it between ticks.

    Attributes:
        started: How often the arm began to move.
    """

    def __init__(self, options: Options, clock: HostClock = REAL_CLOCK):
        self.clock = clock
        model = MODELS[options.controller]
        self.model = model
        self.version = model.version[:2]
        self.rate = options.rate or model.rate
        self.dt = 1.0 / self.rate
        self.registers = Registers()
        joints, tcp = np.array(options.joints), np.array(options.tcp)
        self.arm = KinematicArm(ARMS[options.controller], joints, tcp)
        self.force = ForceReading(options.seed)
        self.program: Program | None = None
        self.payload: tuple[float, tuple[float, ...]] = (0.0, (0.0, 0.0, 0.0))
        self.reason = ""
        self._unlock_after = options.unlock_after
        self._protective_since: float | None = None
        self._watchdog: Watchdog | None = None
        self.started = 0
        self._ticks = 0
        self.snapshot = self._look()

    @property
    def protective(self) -> bool:
        return self._protective_since is not None

    def load(self, text: str) -> None:
        """Start an uploaded script, instead of the one that runs."""
        self.end_program("replaced by another script")
        if self.protective:
            self._note("a script was sent during a protective stop; it does not start")
            return
        try:
            self.program = Program(text, self)
        except ScriptError as err:
            self._note(str(err))

    def end_program(self, reason: str) -> None:
        """Stop the program; the arm comes to rest."""
        if self.program is None:
            return
        self._note(f"program stopped: {reason}")
        self.program, self._watchdog = None, None
        self.arm.stop(PROGRAM_STOP)

    def protective_stop(self, reason: str) -> None:
        self._note(f"protective stop: {reason}")
        self._protective_since = self.clock.now()
        self.program, self._watchdog = None, None
        self.arm.stop(PROTECTIVE_STOP)

    def unlock(self) -> bool:
        """End a protective stop; nothing moves by that. False if it is too early."""
        since = self._protective_since
        if since is not None and self.clock.now() - since < self._unlock_after:
            return False
        self._protective_since = None
        return True

    def receive(self, values: dict[str, float | int]) -> None:
        """Data package of a client."""
        self.registers.inputs.update(values)
        if self._watchdog is not None and self._watchdog.register in values:
            self._watchdog = self._watchdog._replace(kicked=self._ticks)

    def set_watchdog(self, frequency: float, register: int) -> None:
        name = f"input_int_register_{register}"
        armed = frequency > 0.0
        self._watchdog = Watchdog(name, 1.0 / frequency, self._ticks) if armed else None

    def set_payload(self, mass: float, centre: tuple[float, ...]) -> None:
        self.payload = (mass, centre)

    def mount(self, tcp: np.ndarray) -> None:
        """Give the arm, at rest, another tool's centre in the flange's frame."""
        self.arm = KinematicArm(self.arm.model, self.arm.state.joints, tcp)

    def skip(self, ticks: int) -> None:
        """Let the clock go on by ticks that the computer had no time for."""
        self._ticks += ticks
        if self._watchdog is not None:
            self._watchdog = self._watchdog._replace(kicked=self._watchdog.kicked + ticks)

    def tick(self) -> Snapshot:
        """One period: watchdog, program, arm."""
        self._ticks += 1
        dog = self._watchdog
        if dog is not None and (self._ticks - dog.kicked) * self.dt > dog.period + 0.5 * self.dt:
            self.end_program(f"watchdog: {dog.register} not written for {dog.period:.3f} s")
        try:
            if self.program is not None and not self.program.tick():
                self.end_program("it ended")
        except ProgramError as err:
            self.end_program(f"error: {err}")
        except MotionError as err:
            self.protective_stop(str(err))
        rested = self.arm.resting
        try:
            self.arm.tick(self.dt)
        except MotionError as err:
            self.protective_stop(str(err))
        self.started += rested and not self.arm.resting
        self.snapshot = self._look()
        return self.snapshot

    def _look(self) -> Snapshot:
        arm, registers = self.arm, self.registers
        playing = self.program is not None
        return Snapshot(
            time=self._ticks * self.dt,
            host=self.clock.now(),
            joints=tuple(arm.state.joints.tolist()),
            pose=tuple(arm.pose.tolist()),
            velocity=tuple(arm.velocity.tolist()),
            force=self.force.read(),
            runtime_state=PLAYING if playing else STOPPED,
            safety_bits=PROTECTIVE_BITS if self.protective else NORMAL,
            robot_bits=1 | 2 * playing,
            payload=self.payload[0],
            payload_centre=self.payload[1],
            output_ints=tuple(registers.output_ints),
            output_doubles=tuple(registers.output_doubles),
            resting=arm.resting,
        )

    def _note(self, text: str) -> None:
        self.reason = text
        print(f"emulator: {text}", file=sys.stderr, flush=True)
