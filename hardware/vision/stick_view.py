"""A view before its first frame: where the stick and the marker can be."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from ..errors import RigError
from ..rig import Camera, Rig, View
from .camera_model import CameraModel, CameraModelError, look_at, read_camera

SURFACE_MARGIN = 0.003  # the liquid climbs the stick, and waves


@dataclass(frozen=True)
class Scene:
    """Sizes before one camera [m]; the cup's floor is at the origin of the cup frame.

    Attributes:
        cup_radius: Of the liquid's surface and, as drawn, of the glass.
        cup_height: Rim above the floor.
        fill: Depth of the liquid; 0 for an empty cup.
        stick_radius: Of the stick.
        stick_length: From the pivot to the tip.
        marker_offset: From the pivot to the marker's centre as this camera sees it; each camera
            has a marker of its own, on the face of the gripper that it looks at.
        marker_radius: Of the round marker.
        gripper_half_width: In x and in y.
        gripper_below: How far the gripper hangs below the pivot.
        gripper_above: How far it reaches above.
    """

    marker_offset: tuple[float, float, float]
    cup_radius: float = 0.04
    cup_height: float = 0.075
    fill: float = 0.05
    stick_radius: float = 0.0045
    stick_length: float = 0.22
    marker_radius: float = 0.006
    gripper_half_width: float = 0.02
    gripper_below: float = 0.01
    gripper_above: float = 0.04


def circle(radius: float, height: float, points: int = 72) -> np.ndarray:
    """Points [m] of a horizontal circle about the cup's axis, shape (points, 3)."""
    angle = 2.0 * np.pi * np.arange(points) / points
    return np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.full(points, height)]
    )


@dataclass(frozen=True, eq=False)
class StickView:
    """One camera's view of the stick.

    Attributes:
        scene: Sizes of cup, stick and marker.
        camera: Lens and place.
        surface_height: Of the liquid [m]; give the rim's height instead when the cup is not clear.
        contrast: Whether the stick is darker or brighter than what is behind it.
    """

    scene: Scene
    camera: CameraModel
    surface_height: float
    contrast: Literal["dark", "bright"] = "dark"

    @cached_property
    def last_row(self) -> float:
        """Row [px] above which everything is seen above the surface, wherever the stick is."""
        surface = circle(self.scene.cup_radius, self.surface_height + SURFACE_MARGIN, 48)
        rows = self.camera.project(surface)[:, 1]
        if not np.isfinite(rows).all():
            raise CameraModelError(
                f"the surface at {self.surface_height} m is behind the camera at "
                f"{self.camera.position.tolist()}; check position and orientation"
            )
        return float(rows.min())

    @cached_property
    def marker_depth(self) -> float:
        """Depth of the marker [m] while the pivot is above the cup's middle."""
        x, y, _ = self.scene.marker_offset
        return self.camera.depth(np.array([x, y, self.surface_height + self.scene.stick_length]))

    @cached_property
    def scale(self) -> float:
        """Pixels per m at the marker."""
        return self.camera.focal[0] / self.marker_depth


def camera_model(camera: Camera) -> CameraModel:
    """Lens and place of a rig's camera.

    The rig tells where it stands; the lens is that of its `intrinsics` file, or a perfect one.

    Raises:
        RigError: The file of its lens cannot be used, or it looks straight up or down.
    """
    rotation = orientation(camera)
    size, place = (camera.width, camera.height), np.array(camera.position)
    if camera.intrinsics is None:
        focal = float(camera.focal_length or np.nan)
        middle = ((camera.width - 1) / 2, (camera.height - 1) / 2)
        return CameraModel((focal, focal), middle, size, rotation, place)
    lens = _lens(camera)
    return CameraModel(lens.focal, lens.centre, size, rotation, place, lens.distortion)


def orientation(camera: Camera) -> np.ndarray:
    """Turns vectors of the cup frame into the camera's, shape (3, 3); see `look_at`.

    Raises:
        RigError: It looks straight up or down.
    """
    position, target = np.array(camera.position), np.array(camera.target)
    try:
        return look_at(position, target, np.radians(camera.roll_deg))
    except CameraModelError as err:
        raise RigError(str(err), where=f"cameras: {camera.view}", fix="correct rig.toml") from err


def _lens(camera: Camera) -> CameraModel:
    where = f"cameras: {camera.view}: intrinsics"
    try:
        lens = read_camera(Path(str(camera.intrinsics)))
    except (OSError, CameraModelError) as err:
        raise RigError(
            str(err), where=where, fix="run: bolfi-liquids rig calibrate-cameras"
        ) from err
    if lens.size != (camera.width, camera.height):
        raise RigError(
            f"calibrated at {lens.size[0]}x{lens.size[1]}, recorded at "
            f"{camera.width}x{camera.height}",
            where=where,
            fix="calibrate at the size that is recorded",
        )
    return lens


def stick_view(rig: Rig, view: View) -> StickView:
    """View of a rig's camera before its first picture.

    Args:
        rig: Its sizes.
        view: Which camera.

    Raises:
        RigError: See `camera_model`.
    """
    return StickView(
        scene(rig, view),
        camera_model(rig.camera(view)),
        # the wall of the cup bends what is seen through it
        surface_height=rig.cup.height,
        contrast=rig.stick.colour,
    )


def scene(rig: Rig, view: View) -> Scene:
    """Sizes of the cup, the stick and the marker that a rig's camera looks at."""
    camera = rig.camera(view)
    return Scene(
        marker_offset=camera.marker,
        cup_radius=rig.cup.radius,
        cup_height=rig.cup.height,
        fill=rig.cup.fill,
        stick_radius=rig.stick.radius,
        stick_length=rig.stick.length,
        marker_radius=camera.marker_radius,
    )
