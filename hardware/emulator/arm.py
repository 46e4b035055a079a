"""The moving arm: one motion after the other, within its limits."""

import math
from collections.abc import Sequence

import numpy as np

from ..motion.kinematics import DhArm
from .motion import JointState, Motion, MotionError, Plan, Reactive, Timed, Tool, joint_speed

RESTING_RATE = 1e-4  # rad/s; under 0.2 mm/s at the TCP
_REST = np.zeros(6)


class Arm:
    """State of the arm and its queue of plans.

    Attributes:
        state: Joints and their speeds.
        tool: The Denavit-Hartenberg table and the TCP.
        index: Number of the plan that is going on.
        started: How often the arm began to move.
    """

    def __init__(self, model: DhArm, joints: np.ndarray, *, tcp_speed: float = 1.5):
        self.state = JointState(np.array(joints, dtype=float), _REST)
        self.tool = Tool(model, np.zeros(6))
        self.tcp_speed = tcp_speed
        self.pose = self.tool.pose(joints)
        self.velocity = _REST
        self.index = 0
        self.started = 0
        self._plans: list[Plan] = []
        self._motion: Motion | None = None
        self._elapsed = 0.0

    @property
    def busy(self) -> bool:
        return self._motion is not None or bool(self._plans)

    @property
    def resting(self) -> bool:
        return max(map(abs, self.state.speed.tolist())) < RESTING_RATE

    def begin(self, plans: Sequence[Plan], *, brake: float | None = None) -> None:
        """Go on with `plans` instead; with `brake` [rad/s2] the arm first comes to rest."""
        self._motion, self._elapsed, self.index = None, 0.0, 0
        self._plans = list(plans)
        if brake is not None and not self.resting:
            self._motion = joint_speed(self.tool.arm, _REST, brake, ends=True)
            self.index = -1

    def stop(self, rate: float) -> None:
        """Forget all plans and come to rest, joints slowing at `rate` [rad/s2]."""
        self.begin([], brake=rate)

    def place(self, joints: np.ndarray) -> None:
        """Put the arm at rest at other joints, without a motion."""
        self.begin([])
        self.state = JointState(np.array(joints, dtype=float), _REST)
        self._look()

    def mount(self, tcp: np.ndarray) -> None:
        """Set the TCP's pose in the flange's frame."""
        self.tool = Tool(self.tool.arm, np.array(tcp, dtype=float))
        self._look()

    def tick(self, dt: float, scale: float = 1.0) -> None:
        """One step; `scale` is the speed slider's share.

        Raises:
            MotionError: The motion breaks a limit or cannot go on; the caller stops the arm.
        """
        was_resting = self.resting
        if self._motion is None and self._plans:
            self._motion, self._elapsed = self._plans.pop(0)(self.state), 0.0
        if self._motion is None:
            if self.state.speed.any():
                self.state = JointState(self.state.joints, _REST)
                self._look()
            return
        state = self._next(self._motion, dt, scale)
        self._check(state)
        self.state = state
        self._look()
        if was_resting and not self.resting:
            self.started += 1

    def _next(self, motion: Motion, dt: float, scale: float) -> JointState:
        if isinstance(motion, Timed):
            self._elapsed += dt * scale
            joints = motion.joints(self._elapsed, self.state.joints)
            if self._elapsed >= motion.duration:
                self._over()
            return JointState(joints, (joints - self.state.joints) / dt)
        return self._react(motion, dt, scale)

    def _react(self, motion: Reactive, dt: float, scale: float) -> JointState:
        # a brake is not slowed down by the slider
        if motion.ends or scale == 1.0:
            state = motion.step(self.state, dt)
        else:
            state = self._slowed(motion, dt, scale)
        if motion.ends and not state.speed.any():
            self._over()
        return state

    def _slowed(self, motion: Reactive, dt: float, scale: float) -> JointState:
        if scale <= 0.0:
            return JointState(self.state.joints, _REST)
        # the same motion in a time that runs slower
        own = JointState(self.state.joints, self.state.speed / scale)
        state = motion.step(own, dt * scale)
        return JointState(state.joints, state.speed * scale)

    def _over(self) -> None:
        self._motion = None
        self.index += 1

    def _check(self, state: JointState) -> None:
        # in plain floats: every tick, a fifth of what NumPy's functions take for six numbers
        model, joints, speed = self.tool.arm, state.joints.tolist(), state.speed.tolist()
        if not all(map(math.isfinite, (*joints, *speed))):
            raise MotionError("joints or their speeds are not finite")
        # a stop begins from whatever speed and wherever it has to
        if isinstance(self._motion, Reactive) and self._motion.ends:
            return
        if max(map(abs, joints)) > model.joint_limit:
            raise MotionError(f"joints {np.round(joints, 3).tolist()} are beyond the limits")
        share = [abs(one) / most for one, most in zip(speed, model.joint_speed, strict=True)]
        if max(share) > 1.0 + 1e-6:
            raise MotionError(f"joint {share.index(max(share)) + 1} would be too fast")
        if math.hypot(*self.velocity[:3]) > self.tcp_speed:
            raise MotionError(f"the TCP is faster than {self.tcp_speed} m/s")

    def _look(self) -> None:
        self.pose = self.tool.pose(self.state.joints)
        moving = self.state.speed.any()
        self.velocity = (
            self.tool.jacobian(self.state.joints) @ self.state.speed if moving else _REST
        )
