"""moveL and moveJ: motions that are known in advance."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from bolfi_liquids.hardware.emulated.motion import (
    JointState,
    Motion,
    MotionError,
    MountedArm,
    check_numbers,
)
from bolfi_liquids.hardware.motion.kinematics import DhArm
from bolfi_liquids.hardware.motion.poses import matrix_pose, rotation_matrix, rotation_vector


class Trapezoid(NamedTuple):
    """Rest to rest over `length`, with greatest `speed` and `acceleration`."""

    length: float
    speed: float
    acceleration: float

    @property
    def peak(self) -> float:
        # a short way never reaches the full speed
        return min(self.speed, math.sqrt(self.length * self.acceleration))

    @property
    def duration(self) -> float:
        if self.length == 0.0:
            return 0.0
        return self.length / self.peak + self.peak / self.acceleration

    def share(self, elapsed: float) -> float:
        """Share of the length that lies behind after `elapsed` seconds."""
        left = self.duration - elapsed
        if left <= 0.0:
            return 1.0
        ramp = self.peak / self.acceleration
        if elapsed < ramp:
            return 0.5 * self.acceleration * elapsed**2 / self.length
        if left < ramp:
            return 1.0 - 0.5 * self.acceleration * left**2 / self.length
        return self.peak * (elapsed - 0.5 * ramp) / self.length


class Timed(NamedTuple):
    """A motion known in advance: `joints(elapsed, near)` until `duration` [s]."""

    duration: float
    joints: Callable[[float, np.ndarray], np.ndarray]


Plan = Callable[[JointState], Motion | Timed]


def line(
    mounted: MountedArm, start: np.ndarray, pose: np.ndarray, speed: float, rate: float
) -> Timed:
    """moveL: the TCP on a straight line, turning about one axis at the same share of the way.

    `speed` and the acceleration `rate` count for metres or for radians, whichever are more.
    """
    check_numbers(pose=pose, speed=speed, acceleration=rate)
    check_profile(speed, rate)
    origin = mounted.pose(start)
    first, shift = rotation_matrix(origin[3:]), pose[:3] - origin[:3]
    turn = rotation_vector(first.T @ rotation_matrix(pose[3:]))
    mounted.joints(pose, start)
    length = max(np.linalg.norm(shift), np.linalg.norm(turn))
    profile = Trapezoid(float(length), speed, rate)

    def joints(elapsed: float, near: np.ndarray) -> np.ndarray:
        share = profile.share(elapsed)
        now = np.eye(4)
        now[:3, :3] = first @ rotation_matrix(share * turn)
        now[:3, 3] = origin[:3] + share * shift
        return mounted.joints(matrix_pose(now), near)

    return Timed(profile.duration, joints)


def joint_move(
    arm: DhArm, start: np.ndarray, target: np.ndarray, speed: float, rate: float
) -> Timed:
    """moveJ: all joints arrive together; the one with the longest way keeps to the limits."""
    check_numbers(joints=target, speed=speed, acceleration=rate)
    check_profile(speed, rate)
    if np.abs(target).max() > arm.joint_limit:
        raise MotionError(f"joints {np.round(target, 3).tolist()} are beyond the joint limits")
    way = target - start
    longest = np.abs(way).max()
    if longest > 0.0:
        speed = min(
            speed, float(np.min(arm.joint_speed / np.maximum(np.abs(way), 1e-12) * longest))
        )
    profile = Trapezoid(float(longest), speed, rate)
    return Timed(profile.duration, lambda elapsed, near: start + profile.share(elapsed) * way)


def check_profile(speed: float, rate: float) -> None:
    if speed <= 0.0 or rate <= 0.0:
        raise MotionError(f"speed {speed} and acceleration {rate} must be positive")
