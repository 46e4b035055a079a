"""The arm of a controller that runs scripts: one motion after the other, and its speed slider."""

from collections.abc import Sequence

import numpy as np
from bolfi_liquids.hardware.emulated.kinematic_arm import REST, KinematicArm
from bolfi_liquids.hardware.emulated.motion import JointState, Motion, joint_speed
from bolfi_liquids.hardware.motion.kinematics import DhArm

from .moves import Plan, Timed


class QueuedArm(KinematicArm):
    """The kinematic arm with a queue of plans.

    Attributes:
        index: Number of the plan that is going on.
        started: How often the arm began to move.
    """

    def __init__(self, model: DhArm, joints: np.ndarray, *, tcp_speed: float = 1.5):
        super().__init__(model, joints, tcp_speed=tcp_speed)
        self.index = 0
        self.started = 0
        self._plans: list[Plan] = []
        self._going: Motion | Timed | None = None
        self._elapsed = 0.0

    @property
    def busy(self) -> bool:
        return self._going is not None or bool(self._plans)

    def begin(self, plans: Sequence[Plan], *, brake: float | None = None) -> None:
        """Go on with `plans` instead; with `brake` [rad/s2] the arm first comes to rest."""
        self._going, self._elapsed, self.index = None, 0.0, 0
        self._plans = list(plans)
        if brake is not None and not self.resting:
            self._going = joint_speed(REST, brake, ends=True)
            self.index = -1

    def stop(self, rate: float) -> None:
        """Forget all plans and come to rest, joints slowing at `rate` [rad/s2]."""
        self.begin([], brake=rate)

    def place(self, joints: np.ndarray) -> None:
        """Put the arm at rest at other joints, without a motion."""
        self.begin([])
        self.enter(JointState(np.array(joints, dtype=float), REST), stopping=True)

    def tick(self, dt: float, scale: float = 1.0) -> None:
        """One step; `scale` is the speed slider's share.

        Raises:
            MotionError: The motion breaks a limit or cannot go on; the caller stops the arm.
        """
        was_resting = self.resting
        if self._going is None and self._plans:
            self._going, self._elapsed = self._plans.pop(0)(self.state), 0.0
        going = self._going
        if going is None:
            if self.state.speed.any():
                self.enter(JointState(self.state.joints, REST), stopping=True)
            return
        state = self._next(going, dt, scale)
        self.enter(state, stopping=isinstance(going, Motion) and going.ends)
        if was_resting and not self.resting:
            self.started += 1

    def _next(self, going: Motion | Timed, dt: float, scale: float) -> JointState:
        if isinstance(going, Timed):
            self._elapsed += dt * scale
            joints = going.joints(self._elapsed, self.state.joints)
            if self._elapsed >= going.duration:
                self._over()
            return JointState(joints, (joints - self.state.joints) / dt)
        return self._react(going, dt, scale)

    def _react(self, motion: Motion, dt: float, scale: float) -> JointState:
        # a brake is not slowed down by the slider
        if motion.ends or scale == 1.0:
            state = motion.step(self.state, dt)
        else:
            state = self._slowed(motion, dt, scale)
        if motion.ends and not state.speed.any():
            self._over()
        return state

    def _slowed(self, motion: Motion, dt: float, scale: float) -> JointState:
        if scale <= 0.0:
            return JointState(self.state.joints, REST)
        # the same motion in a time that runs slower
        own = JointState(self.state.joints, self.state.speed / scale)
        state = motion.step(own, dt * scale)
        return JointState(state.joints, state.speed * scale)

    def _over(self) -> None:
        self._going = None
        self.index += 1
