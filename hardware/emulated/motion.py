"""An arm without mass: its joints are drawn to set-points, or brought to rest."""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from ..arm import LOOKAHEAD
from ..motion.kinematics import DhArm, forward, inverse, jacobian
from ..motion.poses import Trajectory
from ..motion.stir_paths import PosePath
from ..robot.ur import SERVO_GAIN

SERVO_RATE = 15.0  # rad/s2; the real arm's is not published
TCP_SPEED = 1.5  # m/s, beyond which a controller stops its arm
RESTING_RATE = 1e-4  # rad/s; under 0.2 mm/s at the TCP
REST = np.zeros(6)


class MotionError(Exception):
    """The arm cannot make a motion; the controller answers with a protective stop."""


class JointState(NamedTuple):
    """Joints [rad] and their speeds [rad/s], each of shape [6]."""

    joints: np.ndarray
    speed: np.ndarray


class KinematicArm:
    """The arm and its motion.

    Attributes:
        model: The Denavit-Hartenberg table.
        tcp: The TCP's pose in the flange's frame [m, rad].
        state: Joints and their speeds.
        pose: Of the TCP in the base frame [m, rad].
        velocity: Of the TCP [m/s, rad/s].
        lookahead: Of `servo` [s].
        gain: Of `servo` [1/s2].
    """

    def __init__(self, model: DhArm, joints: np.ndarray, tcp: np.ndarray):
        self.model = model
        self.state = JointState(np.array(joints, dtype=float), REST)
        self._servo: Callable[[JointState, float], JointState] | None = None
        self._deceleration = 0.0  # m/s2 and rad/s2; positive while the arm comes to rest
        self.tcp = np.array(tcp, dtype=float)
        self.lookahead, self.gain = LOOKAHEAD, SERVO_GAIN
        self._look()

    @property
    def resting(self) -> bool:
        """Whether no joint moves."""
        return max(map(abs, self.state.speed.tolist())) < RESTING_RATE

    def reaches(self, pose: np.ndarray) -> bool:
        """Whether the arm reaches a pose at all."""
        return inverse(self.model, pose, self.state.joints, tcp=self.tcp) is not None

    def follow(self, pose: np.ndarray) -> None:
        """Be drawn to a pose from now on, as `servo` says.

        Raises:
            MotionError: The pose is not finite or out of reach.
        """
        found = inverse(self.model, pose, self.state.joints, tcp=self.tcp)
        if found is None:
            raise MotionError(f"no joints for pose {np.round(pose, 4).tolist()}")
        self._deceleration = 0.0
        self._servo = partial(
            servo,
            target=found,
            lookahead=self.lookahead,
            gain=self.gain,
            fastest=np.array(self.model.joint_speed),
        )

    def stop(self, deceleration: float) -> None:
        """Come to rest from now on, as `braked` says."""
        self._servo, self._deceleration = None, deceleration

    def tick(self, dt: float) -> None:
        """Go on for dt [s].

        Raises:
            MotionError: The TCP has become too fast; the caller stops the arm.
        """
        if self._servo is not None:
            self.state = self._servo(self.state, dt)
        elif self._deceleration and self.state.speed.any():
            self.state = braked(self.state, self.velocity, dt, self._deceleration)
        else:
            return
        self._look()
        if self._servo is not None and math.hypot(*self.velocity[:3]) > TCP_SPEED:
            raise MotionError(f"the TCP is faster than {TCP_SPEED} m/s")

    def _look(self) -> None:
        joints, speed = self.state
        self.pose = forward(self.model, joints, tcp=self.tcp)
        moving = speed.any()
        self.velocity = jacobian(self.model, joints, tcp=self.tcp) @ speed if moving else REST


def servo(
    state: JointState,
    dt: float,
    *,
    target: np.ndarray,
    lookahead: float,
    gain: float,
    fastest: np.ndarray,
) -> JointState:
    """One tick in which joints are drawn by gain * (target - joints - lookahead * speed).

    As in the manual, the arm lags a moving target by `lookahead` [s]: a smaller one reacts faster,
    a larger one overshoots less; `gain` [1/s2] stiffens. The real filter is not published. Speeds
    are clipped to `fastest` [rad/s], accelerations to `SERVO_RATE`.
    """
    stay, push, swing, keep = oscillator(gain, gain * lookahead, dt)
    away = state.joints - target
    wanted = swing * away + keep * state.speed
    change = np.clip(wanted - state.speed, -SERVO_RATE * dt, SERVO_RATE * dt)
    speed = np.clip(state.speed + change, -fastest, fastest)
    if np.array_equal(speed, wanted):
        joints = target + stay * away + push * state.speed
    else:
        joints = state.joints + 0.5 * dt * (state.speed + speed)
    if np.abs(joints - target).max() < 1e-8 and np.abs(speed).max() < 1e-6:
        return JointState(target, REST)
    return JointState(joints, speed)


def braked(state: JointState, velocity: np.ndarray, dt: float, deceleration: float) -> JointState:
    """One tick in which all joints slow down together, so that the TCP loses deceleration * dt.

    Args:
        state: Joints and their speeds, before the tick.
        velocity: Of the TCP [m/s, rad/s].
        dt: Of the tick [s].
        deceleration: Of the TCP [m/s2] and of its turn [rad/s2]; the longer of both stops counts.
    """
    fastest = max(math.hypot(*velocity[:3]), math.hypot(*velocity[3:]))
    share = 1.0 - deceleration * dt / fastest if fastest > 0.0 else 0.0
    speed = state.speed * max(share, 0.0)
    return JointState(state.joints + 0.5 * dt * (state.speed + speed), speed)


@lru_cache(100)
def oscillator(stiffness: float, damping: float, dt: float) -> tuple[float, float, float, float]:
    """exp(A dt) of x'' = -stiffness x - damping x', row by row: exact at any step."""
    values, vectors = np.linalg.eig(np.array([[0.0, 1.0], [-stiffness, -damping]]) + 0j)
    # two equal roots leave no basis of eigenvectors; a shift of 1e-6 of one does not show
    if abs(values[0] - values[1]) < 1e-6 * abs(values[0]):
        return oscillator(stiffness * (1.0 + 1e-6), damping, dt)
    exact = (vectors * np.exp(values * dt)) @ np.linalg.inv(vectors)
    (a, b), (c, d) = exact.real.tolist()
    return a, b, c, d


def servoed(path: PosePath) -> Trajectory:
    """Way of the emulated arm that is servoed along a path, in the path's frame.

    It lags by some 0.1 s and rounds corners off by 1 to 2 mm. The servo acts on joints; over a
    cup's width the same filter acts on positions.

    Args:
        path: From rest to rest; an arm that starts it rests at its first pose.

    Returns:
        The path's times [s], and the tool's centre at each [m].
    """
    period = float(path.time[1] - path.time[0])
    stay, push, swing, keep = oscillator(SERVO_GAIN, SERVO_GAIN * LOOKAHEAD, period)
    targets = path.pose[:, :3]
    position, speed = targets[0], np.zeros(3)
    way = np.empty_like(targets)
    for at, target in enumerate(targets):
        away = position - target
        position, speed = target + stay * away + push * speed, swing * away + keep * speed
        way[at] = position
    return Trajectory(path.time, way)
