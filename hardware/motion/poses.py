"""Poses: position [m] and rotation vector [rad], six numbers, as UR controllers write them.

An emulated arm turns them at each of its ticks: a matrix takes 2 us of CPU time here and 11 us by
scipy's Rotation, a rotation vector 1 us and 47 us, where 10 us are the limit.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..rig import CupSettings

Numbers = Sequence[float] | np.ndarray


def rotation_matrix(rotvec: Numbers) -> np.ndarray:
    """Rotation by |rotvec| [rad] about rotvec, shape [3, 3] (Rodrigues).

    Args:
        rotvec: Rotation vector [rad], shape [3].
    """
    x, y, z = (float(value) for value in rotvec)
    angle = math.sqrt(x * x + y * y + z * z)
    # both quotients reach their limits smoothly; below 1e-8 the next terms are under rounding
    sine = math.sin(angle) / angle if angle > 1e-8 else 1.0
    cosine = 2.0 * (math.sin(0.5 * angle) / angle) ** 2 if angle > 1e-8 else 0.5
    return np.array(
        [
            [1.0 - cosine * (y * y + z * z), cosine * x * y - sine * z, cosine * x * z + sine * y],
            [cosine * x * y + sine * z, 1.0 - cosine * (x * x + z * z), cosine * y * z - sine * x],
            [cosine * x * z - sine * y, cosine * y * z + sine * x, 1.0 - cosine * (x * x + y * y)],
        ]
    )


def rotation_vector(matrix: np.ndarray) -> np.ndarray:
    """Rotation vector [rad] of a rotation matrix, shape [3], of length at most pi.

    Goes through the unit quaternion, from its largest component, so that it stays exact near
    0 and near pi. At pi both signs are right; one of them is returned.

    Args:
        matrix: Rotation, shape [3, 3].
    """
    (a, b, c), (d, e, f), (g, h, i) = matrix[:3, :3].tolist()
    squares = (1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i)
    largest = squares.index(max(squares))
    if largest == 0:
        w, x, y, z = squares[0], h - f, c - g, d - b
    elif largest == 1:
        w, x, y, z = h - f, squares[1], b + d, c + g
    elif largest == 2:
        w, x, y, z = c - g, b + d, squares[2], f + h
    else:
        w, x, y, z = d - b, c + g, f + h, squares[3]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return np.zeros(3)
    scale = 2.0 * math.atan2(length, w) / length
    return np.array([scale * x, scale * y, scale * z])


def pose_matrix(pose: Numbers) -> np.ndarray:
    """The pose as a homogeneous transform, shape [4, 4]."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrix(pose[3:6])
    matrix[:3, 3] = pose[:3]
    return matrix


def matrix_pose(matrix: np.ndarray) -> np.ndarray:
    """The pose, shape [6], of a homogeneous transform."""
    return np.concatenate([matrix[:3, 3], rotation_vector(matrix)])


class CupFrame(NamedTuple):
    """Place of the cup: origin [m], shape (3,), and axes (columns), in the base frame."""

    origin: np.ndarray
    axes: np.ndarray

    def to_base(self, pose: np.ndarray) -> np.ndarray:
        """Poses with the position in the base frame; turns are in it already.

        Args:
            pose: Position [m] in the cup's frame and rotation vector [rad] in the base frame,
                shape (..., 6).
        """
        return np.concatenate([self.origin + pose[..., :3] @ self.axes.T, pose[..., 3:]], axis=-1)

    def from_base(self, pose: np.ndarray) -> np.ndarray:
        """Undo `to_base`."""
        return np.concatenate([(pose[..., :3] - self.origin) @ self.axes, pose[..., 3:]], axis=-1)


def cup_frame(cup: CupSettings) -> CupFrame:
    """The frame of a rig's cup."""
    yaw = np.radians(cup.yaw_deg)
    cos, sin = np.cos(yaw), np.sin(yaw)
    axes = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return CupFrame(np.array(cup.position), axes)


class Trajectory(NamedTuple):
    """Times [s], shape [T], increasing, and positions [m], shape [T, 3], in the cup's frame."""

    time: np.ndarray
    position: np.ndarray
