"""The moving arm: where its joints are, and the motion that it makes within its limits."""

import math

import numpy as np

from ..motion.kinematics import DhArm
from .motion import JointState, Motion, MotionError, MountedArm

RESTING_RATE = 1e-4  # rad/s; under 0.2 mm/s at the TCP
REST = np.zeros(6)


class KinematicArm:
    """An arm without mass.

    Attributes:
        state: Joints and their speeds.
        mounted: The Denavit-Hartenberg table and the TCP.
        tcp_speed: Limit of the TCP's speed [m/s].
        pose: Of the TCP in the base frame [m, rad].
        velocity: Of the TCP [m/s, rad/s].
    """

    def __init__(self, model: DhArm, joints: np.ndarray, *, tcp_speed: float = 1.5):
        self.state = JointState(np.array(joints, dtype=float), REST)
        self.mounted = MountedArm(model, np.zeros(6))
        self.tcp_speed = tcp_speed
        self.pose = self.mounted.pose(joints)
        self.velocity = REST
        self._motion: Motion | None = None

    @property
    def resting(self) -> bool:
        return max(map(abs, self.state.speed.tolist())) < RESTING_RATE

    def mount(self, tcp: np.ndarray) -> None:
        """Set the TCP's pose in the flange's frame."""
        self.mounted = MountedArm(self.mounted.arm, np.array(tcp, dtype=float))
        self._look()

    def follow(self, motion: Motion) -> None:
        """Make a motion from now on, instead of the one before."""
        self._motion = motion

    def tick(self, dt: float) -> None:
        """Go on for dt [s].

        Raises:
            MotionError: The motion breaks a limit or cannot go on; the caller stops the arm.
        """
        motion = self._motion
        if motion is None:
            return
        self.enter(motion.step(self.state, dt), stopping=motion.ends)
        if motion.ends and not self.state.speed.any():
            self._motion = None

    def enter(self, state: JointState, *, stopping: bool) -> None:
        """Take over another state.

        Args:
            state: After a tick.
            stopping: Whether it belongs to a stop, which begins from whatever speed and wherever
                it has to.

        Raises:
            MotionError: It breaks a limit; the arm stays where it is.
        """
        self._check(state, stopping)
        self.state = state
        self._look()

    def _check(self, state: JointState, stopping: bool) -> None:
        # in plain floats: every tick, a fifth of what NumPy's functions take for six numbers
        model, joints, speed = self.mounted.arm, state.joints.tolist(), state.speed.tolist()
        if not all(map(math.isfinite, (*joints, *speed))):
            raise MotionError("joints or their speeds are not finite")
        if stopping:
            return
        if max(map(abs, joints)) > model.joint_limit:
            raise MotionError(f"joints {np.round(joints, 3).tolist()} are beyond the limits")
        share = [abs(one) / most for one, most in zip(speed, model.joint_speed, strict=True)]
        if max(share) > 1.0 + 1e-6:
            raise MotionError(f"joint {share.index(max(share)) + 1} would be too fast")
        if math.hypot(*self.velocity[:3]) > self.tcp_speed:
            raise MotionError(f"the TCP is faster than {self.tcp_speed} m/s")

    def _look(self) -> None:
        self.pose = self.mounted.pose(self.state.joints)
        moving = self.state.speed.any()
        self.velocity = (
            self.mounted.jacobian(self.state.joints) @ self.state.speed if moving else REST
        )
