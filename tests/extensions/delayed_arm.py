"""An arm of one's own: it is where it was told to be `LOOKAHEAD` seconds ago.

Give it to `hardware.SessionSetup(rig, directory, arm=DelayedArm(joints), ...)`, and check one of
your own by `pytest tests/extensions --arm your_module:YourController`.
"""

from typing import NamedTuple

import numpy as np
from bolfi_liquids.hardware.arm import (
    LOOKAHEAD,
    WATCHDOG_PERIOD,
    ArmState,
    LinkLost,
    PathFollower,
    Payload,
    Six,
    Tool,
)
from bolfi_liquids.hardware.motion.kinematics import forward, inverse
from bolfi_liquids.hardware.process import REAL_CLOCK, HostClock
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.safety.guards import NORMAL, PLAYING, RUNNING_MODE
from bolfi_liquids.hardware.safety.limits import TargetCheck, workspace


class DelayedArm(NamedTuple):
    """The controller: it opens the arm.

    Attributes:
        joints: At the start [rad], shape (6,).
        clock: By which it goes.
    """

    joints: tuple[float, ...]
    clock: HostClock = REAL_CLOCK

    @property
    def address(self) -> str:
        return "delayed"

    def reader(self, rig: Rig) -> "Arm":
        return Arm(rig, "stirring", self)

    def follower(self, rig: Rig, tool: Tool) -> "Arm":
        return Arm(rig, tool, self)


class Arm(PathFollower):
    def __init__(self, rig: Rig, tool: Tool, controller: DelayedArm):
        self._robot, self._space = rig.robot, workspace(rig, tool)
        self._period, self._clock = 1.0 / rig.robot.rate, controller.clock
        self._check = TargetCheck(rig, tool)
        pose = forward(self._space.arm, controller.joints, tcp=self._space.tcp)
        self._told = [(-np.inf, pose)]  # set-points, and when they came
        self._begun = self._clock.now()
        self._payload = Payload(0.0, (0.0, 0.0, 0.0))
        self._playing, self._guarded = False, np.inf  # since when the watchdog is armed

    def connect(self) -> None: ...

    def close(self) -> None: ...

    def time(self) -> float:
        return self._period * int((self._clock.now() - self._begun) / self._period + 1e-6)

    def payload(self) -> Payload:
        return self._payload

    def tcp(self) -> Six:
        return tuple(self._space.tcp.tolist())

    def allows(self, pose: np.ndarray) -> bool:
        return self._joints(pose) is not None

    def read(self) -> ArmState:
        self._look_after()
        now = self._clock.now()
        pose, before = self._pose(now), self._pose(now - self._period)
        return ArmState(
            time=self.time(),
            pose=tuple(pose.tolist()),
            velocity=(*((pose - before)[:3] / self._period).tolist(), 0.0, 0.0, 0.0),
            wrench=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            joints=tuple(self._joints(pose).tolist()),
            robot_mode=RUNNING_MODE,
            runtime_state=PLAYING if self._playing else 1,
            safety_bits=NORMAL,
            speed_scaling=1.0,
            speed_slider=1.0,
            connected=True,
        )

    def take_control(self) -> None:
        self._playing = True
        self._payload = Payload(self._robot.payload, self._robot.payload_centre)

    def arm_watchdog(self) -> None:
        self._guarded = self._clock.now()

    def command(self, pose: np.ndarray) -> None:
        self._look_after()
        if not self._playing:
            raise LinkLost("the arm was stopped, and takes no set-point any more")
        self._check(self._told[-1][1], pose)
        self._told.append((self._clock.now(), pose))

    def stop(self) -> None:
        if self._playing:
            self._end(self._clock.now())

    def give_up(self) -> None:
        self.stop()

    def _pose(self, time: float) -> np.ndarray:
        return next(pose for came, pose in reversed(self._told) if came <= time - LOOKAHEAD)

    def _joints(self, pose: np.ndarray) -> np.ndarray | None:
        return inverse(self._space.arm, pose, self._space.start, tcp=self._space.tcp)

    def _look_after(self) -> None:
        """End the program when set-points have ceased."""
        end = max(self._told[-1][0], self._guarded) + WATCHDOG_PERIOD
        if self._playing and self._clock.now() > end + 0.5 * self._period:
            self._end(end)

    def _end(self, time: float) -> None:
        self._playing, self._told = False, [(-np.inf, self._pose(time))]
