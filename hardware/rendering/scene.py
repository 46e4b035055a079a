"""The scene that the rendered cameras look at, and how its picture looks."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scene:
    """Sizes [m]; the cup stands on its floor at the origin of the cup frame.

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


@dataclass(frozen=True)
class Look:
    """How the picture looks; grey levels are 0 to 255.

    Attributes:
        background: Mean grey level behind everything.
        clutter: Standard deviation of the background's smooth texture.
        stick, liquid, gripper, marker, glass: Grey levels.
        exposure: Time over which a moving thing is smeared [s].
        defocus: Standard deviation of the lens's blur [px].
        read_noise: Standard deviation of the noise in the dark.
        shot_noise: Variance per grey level.
    """

    background: float = 190.0
    clutter: float = 6.0
    stick: float = 45.0
    liquid: float = 150.0
    gripper: float = 60.0
    marker: float = 235.0
    glass: float = 120.0
    exposure: float = 0.008
    defocus: float = 0.8
    read_noise: float = 2.0
    shot_noise: float = 0.05


BRIGHT_STICK = Look(background=50.0, stick=210.0, liquid=90.0, gripper=30.0)


def circle(radius: float, height: float, points: int = 72) -> np.ndarray:
    """Points [m] of a horizontal circle about the cup's axis, shape (points, 3)."""
    angle = 2.0 * np.pi * np.arange(points) / points
    return np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.full(points, height)]
    )
