"""Motions of the arm as pure functions of its state."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..motion.kinematics import DhArm, forward, inverse, jacobian
from ..motion.poses import Numbers


class MotionError(Exception):
    """The arm cannot do what it was told; the controller answers with a protective stop."""


class JointState(NamedTuple):
    """Joints [rad] and their speeds [rad/s], each of shape [6]."""

    joints: np.ndarray
    speed: np.ndarray


class MountedArm(NamedTuple):
    """The arm and what is mounted on it: `tcp` is the TCP's pose in the flange's frame."""

    arm: DhArm
    tcp: np.ndarray

    def pose(self, joints: Numbers) -> np.ndarray:
        return forward(self.arm, joints, tcp=self.tcp)

    def joints(self, pose: Numbers, near: Numbers) -> np.ndarray:
        """Joints for a pose.

        Raises:
            MotionError: The pose is not finite or out of reach.
        """
        found = inverse(self.arm, pose, near, tcp=self.tcp)
        if found.status == "unreachable":
            raise MotionError(f"no joints for pose {np.round(pose, 4).tolist()}")
        return found.joints

    def jacobian(self, joints: Numbers) -> np.ndarray:
        return jacobian(self.arm, joints, tcp=self.tcp)


Step = Callable[[JointState, float], JointState]


class Motion(NamedTuple):
    """A motion that follows from the state: `step(state, dt)`.

    With `ends` it is over as soon as the arm rests.
    """

    step: Step
    ends: bool = False


def check_numbers(**values: Numbers | float) -> None:
    for name, value in values.items():
        if not np.isfinite(value).all():
            raise MotionError(f"{name} {value} is not finite")


def servo(arm: DhArm, target: np.ndarray, lookahead: float, gain: float, limit: float) -> Motion:
    """servoJ: the joints are drawn to `target` by gain * (target - joints - lookahead * speed).

    This has what the manual tells of both numbers: the arm lags a moving target by `lookahead`
    [s], a smaller one reacts faster, a larger one overshoots less, and `gain` [1/s2] stiffens.
    The real filter is not published. Speeds are clipped to the joints' own, accelerations to
    `limit` [rad/s2].
    """
    check_numbers(target=target, lookahead=lookahead, gain=gain)
    if np.abs(target).max() > arm.joint_limit:
        raise MotionError(f"joints {np.round(target, 3).tolist()} are beyond the joint limits")
    fastest = np.array(arm.joint_speed)

    def step(state: JointState, dt: float) -> JointState:
        stay, push, swing, keep = oscillator(gain, gain * lookahead, dt)
        away = state.joints - target
        wanted = swing * away + keep * state.speed
        change = np.clip(wanted - state.speed, -limit * dt, limit * dt)
        speed = np.clip(state.speed + change, -fastest, fastest)
        if np.array_equal(speed, wanted):
            joints = target + stay * away + push * state.speed
        else:
            joints = state.joints + 0.5 * dt * (state.speed + speed)
        if np.abs(joints - target).max() < 1e-8 and np.abs(speed).max() < 1e-6:
            return JointState(target, np.zeros(6))
        return JointState(joints, speed)

    return Motion(step)


_CACHE: dict[tuple[float, float, float], tuple[float, float, float, float]] = {}


def oscillator(stiffness: float, damping: float, dt: float) -> tuple[float, float, float, float]:
    """exp(A dt) of x'' = -stiffness x - damping x', row by row: exact at any step."""
    key = (stiffness, damping, dt)
    if key not in _CACHE:
        if len(_CACHE) > 100:
            _CACHE.clear()
        values, vectors = np.linalg.eig(np.array([[0.0, 1.0], [-stiffness, -damping]]) + 0j)
        # two equal roots leave no basis of eigenvectors; a shift of 1e-6 of one does not show
        if abs(values[0] - values[1]) < 1e-6 * abs(values[0]):
            return oscillator(stiffness * (1.0 + 1e-6), damping, dt)
        exact = (vectors * np.exp(values * dt)) @ np.linalg.inv(vectors)
        (a, b), (c, d) = exact.real.tolist()
        _CACHE[key] = (a, b, c, d)
    return _CACHE[key]


def joint_speed(target: np.ndarray, rate: float, *, ends: bool = False) -> Motion:
    """speedJ, and stopJ with target zero: all speeds reach the target together, at `rate`."""
    check_numbers(speed=target, acceleration=rate)
    if rate <= 0.0:
        raise MotionError(f"acceleration {rate} must be positive")

    def step(state: JointState, dt: float) -> JointState:
        speed = approached(state.speed, target, rate * dt, largest=True)
        return JointState(state.joints + 0.5 * dt * (state.speed + speed), speed)

    return Motion(step, ends)


def twist(mounted: MountedArm, target: np.ndarray, rate: float, *, ends: bool = False) -> Motion:
    """speedL, and stopL with target zero: TCP velocity [m/s, rad/s] approaches the target.

    `rate` bounds the change of the velocity [m/s2] and that of the turning [rad/s2].
    """
    check_numbers(speed=target, acceleration=rate)
    if rate <= 0.0:
        raise MotionError(f"acceleration {rate} must be positive")

    def step(state: JointState, dt: float) -> JointState:
        moving = mounted.jacobian(state.joints) @ state.speed
        next_twist = np.concatenate(
            [
                approached(moving[:3], target[:3], rate * dt),
                approached(moving[3:], target[3:], rate * dt),
            ]
        )
        if not next_twist.any():
            return JointState(state.joints + 0.5 * dt * state.speed, np.zeros(6))
        ahead = state.joints + dt * state.speed
        try:
            speed = np.linalg.solve(mounted.jacobian(ahead), next_twist)
        except np.linalg.LinAlgError as err:
            raise MotionError("the arm is in a singular configuration") from err
        return JointState(state.joints + 0.5 * dt * (state.speed + speed), speed)

    return Motion(step, ends)


def approached(
    value: np.ndarray, target: np.ndarray, most: float, *, largest: bool = False
) -> np.ndarray:
    """`value` moved straight towards `target`, by `most` in length (or in its largest part)."""
    way = target - value
    length = np.abs(way).max() if largest else math.sqrt(float(way @ way))
    return target if length <= most else value + way * (most / length)
