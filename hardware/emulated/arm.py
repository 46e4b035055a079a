"""The emulated arm as a driver: it moves on by the clock of the process that commands it."""

import random
from typing import NamedTuple

import numpy as np

from ..arm import WATCHDOG_PERIOD, ArmState, LinkLost, PathFollower, Payload, Six, Tool
from ..motion.poses import cup_frame
from ..process import REAL_CLOCK, HostClock
from ..rendering.world import SharedWorld, WorldState
from ..rig import Rig
from ..robot.ur import STOP_DECELERATION
from ..safety.guards import NORMAL, PLAYING, RUNNING_MODE
from ..safety.limits import TargetCheck, workspace
from . import stick
from .motion import KinematicArm, MotionError
from .stick import StickMotion

PROTECTIVE_STOP = 10.0  # m/s2 and rad/s2
STOPPED = 1  # runtime_state without a program
PROTECTIVE_BITS = 1 << 2 | 1 << 10  # protective stopped; stopped due to safety
FORCE_NOISE = (0.2, 0.2, 0.2, 0.02, 0.02, 0.02)  # N and Nm, standard deviation
MAX_LATENESS = 0.05  # s; ticks that are later are left out, not made up for


class EmulatedController(NamedTuple):
    """Opens an emulated arm, at rest.

    Attributes:
        joints: At the start [rad], shape (6,).
        begun: Host time at which the controller's clock was 0 [s].
        tool: In the gripper.
        seed: Of the force's noise.
        stir: How the stick hangs while it stirs, in the cup's frame; None: straight down.
        world: Where cameras see the stick; None without cameras.
        clock: Of the process that commands the arm.
    """

    joints: tuple[float, ...]
    begun: float
    tool: Tool = "stirring"
    seed: int = 0
    stir: StickMotion | None = None
    world: SharedWorld | None = None
    clock: HostClock = REAL_CLOCK

    @property
    def address(self) -> str:
        """No network's."""
        return "emulated"

    def reader(self, rig: Rig) -> "EmulatedArm":
        """The arm to look at, not connected yet."""
        return EmulatedArm(rig, self.tool, self)

    def follower(self, rig: Rig, tool: Tool) -> "EmulatedArm":
        """The arm to command with a tool in its gripper, not connected yet."""
        return EmulatedArm(rig, tool, self)


class EmulatedArm(PathFollower):
    """An arm without mass, in the process that commands it.

    It moves on whenever somebody looks at it or commands it, by all ticks that are due by then. As
    on a controller, a program takes the set-points, a watchdog ends it when they cease, and what
    the arm cannot do is a protective stop; nothing resumes.
    """

    def __init__(self, rig: Rig, tool: Tool, controller: EmulatedController):
        space = workspace(rig, tool)
        self._robot = rig.robot
        self._dt = 1.0 / rig.robot.rate
        self._frame = cup_frame(rig.cup)
        self._check = TargetCheck(rig, tool)
        self._clock, self._begun = controller.clock, controller.begun
        self._world = controller.world
        self._stick = None if controller.stir is None else stick.init(controller.stir)
        self._arm = KinematicArm(space.arm, np.array(controller.joints), space.tcp)
        self._payload = Payload(0.0, (0.0, 0.0, 0.0))
        self._noise = random.Random(controller.seed)
        self._wrench = self._force()
        self._previous: np.ndarray | None = None  # set-point
        self._playing = self._guarded = self._stopped = self._protective = False
        self._ticks = 0
        self._fed = 0  # tick of the latest set-point

    def connect(self) -> None:
        self._ticks = self._due()
        self._show()

    def read(self) -> ArmState:
        arm = self._arm
        return ArmState(
            time=self.time(),
            pose=_six(arm.pose),
            velocity=_six(arm.velocity),
            wrench=self._wrench,
            joints=_six(arm.state.joints),
            robot_mode=RUNNING_MODE,
            runtime_state=PLAYING if self._playing else STOPPED,
            safety_bits=PROTECTIVE_BITS if self._protective else NORMAL,
            speed_scaling=1.0,
            speed_slider=1.0,
            connected=True,
        )

    def time(self) -> float:
        self._go_on()
        return self._ticks * self._dt

    def payload(self) -> Payload:
        return self._payload

    def close(self) -> None:
        """Nothing to let go."""

    def take_control(self) -> None:
        self._payload = Payload(self._robot.payload, self._robot.payload_centre)
        self._playing = True

    def tcp(self) -> Six:
        return _six(self._arm.tcp)

    def allows(self, pose: np.ndarray) -> bool:
        """Whether the arm reaches a pose at all; safety planes are not emulated."""
        return self._arm.reaches(pose)

    def arm_watchdog(self) -> None:
        self._go_on()
        self._guarded, self._fed = True, self._ticks

    def command(self, pose: np.ndarray) -> None:
        self._go_on()
        self._check(self._arm.pose if self._previous is None else self._previous, pose)
        if self._stopped or not self._playing:
            raise LinkLost("the controller's program has ended, and takes no set-point any more")
        self._previous, self._fed = pose, self._ticks
        try:
            self._arm.follow(pose)
        except MotionError:
            self._protect()

    def stop(self) -> None:
        self._go_on()
        if self._playing:
            self._end_program(STOP_DECELERATION)
        self._stopped = True

    def give_up(self) -> None:
        self.stop()

    def _due(self) -> int:
        return int((self._clock.now() - self._begun) / self._dt + 1e-6)

    def _go_on(self) -> None:
        """Make the ticks that are due, but for those that this process had no time for.

        A real arm would move on in a stall; this one stands still, and so does its watchdog.
        """
        due = self._due()
        left_out = max(due - self._ticks - round(MAX_LATENESS / self._dt), 0)
        self._ticks += left_out
        self._fed += left_out
        while self._ticks < due:
            self._tick()

    def _tick(self) -> None:
        self._ticks += 1
        silent = (self._ticks - self._fed) * self._dt
        if self._playing and self._guarded and silent > WATCHDOG_PERIOD + 0.5 * self._dt:
            self._end_program(STOP_DECELERATION)
        try:
            self._arm.tick(self._dt)
        except MotionError:
            self._protect()
        self._wrench = self._force()
        if self._stick is not None:
            pivot = self._frame.from_base(self._arm.pose)[:3]
            self._stick = stick.advance(self._stick, pivot, self._dt)
        self._show()

    def _show(self) -> None:
        """Let cameras see where the stick is."""
        if self._world is None:
            return
        time = self._ticks * self._dt
        pivot = self._frame.from_base(self._arm.pose)[:3]
        inclination = np.zeros(2) if self._stick is None else np.array(stick.angles(self._stick))
        self._world.write(self._begun + time, WorldState(time, pivot, inclination))

    def _protect(self) -> None:
        self._protective = True
        self._end_program(PROTECTIVE_STOP)

    def _end_program(self, deceleration: float) -> None:
        """Take no further set-point; the arm comes to rest."""
        self._playing = False
        self._arm.stop(deceleration)

    def _force(self) -> Six:
        """Noise alone: nothing presses."""
        fx, fy, fz, tx, ty, tz = (self._noise.gauss(0.0, noise) for noise in FORCE_NOISE)
        return fx, fy, fz, tx, ty, tz


def _six(values: np.ndarray) -> Six:
    a, b, c, d, e, f = values.tolist()
    return a, b, c, d, e, f
