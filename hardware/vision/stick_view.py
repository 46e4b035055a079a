"""What is known about a view before its first frame: where the stick and the marker can be."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from .camera_model import CameraModel, CameraModelError

SURFACE_MARGIN = 0.003  # the liquid climbs the stick, and waves


@dataclass(frozen=True, eq=False)
class StickView:
    """One camera's view of the stick; lengths in m, places in the cup frame.

    Attributes:
        camera: That looks.
        stick_radius: Of the stick.
        stick_length: From the pivot to the tip.
        marker_offset: From the pivot to the centre of this camera's marker on the gripper.
        marker_radius: Of the round, bright marker on the dark gripper.
        surface_height: Of the liquid; give the rim's height instead when the cup is not clear.
        cup_radius: Of the surface.
        gripper_below: The gripper hides this length of the stick below the pivot.
        contrast: Whether the stick is darker or brighter than what is behind it.
    """

    camera: CameraModel
    stick_radius: float
    stick_length: float
    marker_offset: tuple[float, float, float]
    marker_radius: float
    surface_height: float
    cup_radius: float
    gripper_below: float = 0.01
    contrast: Literal["dark", "bright"] = "dark"

    @cached_property
    def last_row(self) -> float:
        """Row [px] above which everything is seen above the surface, wherever the stick is."""
        angle = 2.0 * np.pi * np.arange(48) / 48
        rim = self.cup_radius * np.column_stack([np.cos(angle), np.sin(angle)])
        height = np.full((48, 1), self.surface_height + SURFACE_MARGIN)
        rows = self.camera.project(np.hstack([rim, height]))[:, 1]
        if not np.isfinite(rows).all():
            raise CameraModelError(
                f"the surface at {self.surface_height} m is behind the camera at "
                f"{self.camera.position.tolist()}; check position and orientation"
            )
        return float(rows.min())

    @cached_property
    def marker_depth(self) -> float:
        """Depth of the marker [m] while the pivot is above the cup's middle."""
        x, y, _ = self.marker_offset
        return self.camera.depth(np.array([x, y, self.surface_height + self.stick_length]))

    @cached_property
    def scale(self) -> float:
        """Pixels per m at the marker."""
        return self.camera.focal[0] / self.marker_depth
