"""Rendered scenes for tests: where two webcams would stand about the cup, and what moves there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from bolfi_liquids.hardware.rendering import Look, Scene, WorldState
from bolfi_liquids.hardware.vision.camera_model import CameraModel, look_at
from bolfi_liquids.hardware.vision.stick_view import StickView

CLEAN = Look(clutter=0.0, exposure=0.0, defocus=0.0, read_noise=0.0, shot_noise=0.0)

PIVOT_TO_MARKER = 0.02  # m, from the pivot to the face of the gripper that carries a marker
MARKER_ABOVE = 0.025  # m
LOOK_AT = (0.0, 0.0, 0.13)  # m; what both cameras look at

ViewName = Literal["xz", "yz"]


def rehearsal_camera(
    view: ViewName,
    *,
    distance: float = 0.45,
    height: float = 0.14,
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0),
) -> CameraModel:
    """A webcam of 640 by 480 pixels and 53 degrees; "xz" looks along +y, "yz" along -x.

    Args:
        view: Which.
        distance: Of the lens from the cup's axis [m].
        height: Of the lens above the cup's floor [m].
        distortion: k1, k2, p1, p2, k3.
    """
    side = {"xz": [0.0, -distance], "yz": [distance, 0.0]}[view]
    position = np.array([*side, height])
    return CameraModel(
        focal=(640.0, 640.0),
        centre=(319.5, 239.5),
        size=(640, 480),
        rotation=look_at(position, np.array(LOOK_AT)),
        position=position,
        distortion=distortion,
    )


def rehearsal_scene(view: ViewName) -> Scene:
    """The scene with the marker that faces this camera."""
    side = {"xz": (0.0, -PIVOT_TO_MARKER), "yz": (PIVOT_TO_MARKER, 0.0)}[view]
    return Scene(marker_offset=(*side, MARKER_ABOVE))


def stick_view(scene: Scene, camera: CameraModel, look: Look | None = None) -> StickView:
    """What a camera knows before its first frame when it looks at a rendered scene."""
    bright = look is not None and look.stick > look.background
    return StickView(scene, camera, scene.fill, "bright" if bright else "dark")


@dataclass(frozen=True)
class MovingWorld:
    """A motion given by formulae.

    Attributes:
        pivot: Position [m], shape (3,), at a time of the robot's clock [s].
        inclination: Of the stick [rad], shape (2,), at a time of the robot's clock [s].
        offset: Robot's clock minus this computer's [s].
    """

    pivot: Callable[[float], np.ndarray]
    inclination: Callable[[float], np.ndarray]
    offset: float = 0.0

    def state(self, host: float) -> WorldState:
        """The scene at a time of this computer's clock [s]."""
        time = host + self.offset
        return WorldState(time, self.pivot(time), self.inclination(time))
