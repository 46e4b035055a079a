"""Between the cup's frame, in which paths are written, and the base frame of the robot."""

from typing import NamedTuple

import numpy as np

from ..rig import CupSettings


class CupFrame(NamedTuple):
    """Where the cup stands: origin [m], shape (3,), and axes (columns), in the base frame."""

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
        """Undoes `to_base`."""
        return np.concatenate([(pose[..., :3] - self.origin) @ self.axes, pose[..., 3:]], axis=-1)


def cup_frame(cup: CupSettings) -> CupFrame:
    """The frame of a rig's cup."""
    yaw = np.radians(cup.yaw_deg)
    cos, sin = np.cos(yaw), np.sin(yaw)
    axes = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return CupFrame(np.array(cup.position), axes)
