"""Outlines of the stick in the picture: above the surface, and refracted below it."""

import numpy as np

from ..vision.camera_model import CameraModel
from .scene import Scene
from .world import WorldState, direction


def surface_share(state: WorldState, scene: Scene) -> float:
    """Share of the stick, from the pivot, at which its axis meets the surface; 1 if nowhere."""
    down = direction(state.inclination)
    reach = (scene.fill - state.pivot[2]) / (down[2] * scene.stick_length)
    entry = state.pivot + reach * scene.stick_length * down
    meets = 0.0 < reach < 1.0 and np.hypot(*entry[:2]) < scene.cup_radius
    return float(reach) if meets and scene.fill > 0 else 1.0


def bar_sides(state: WorldState, camera: CameraModel, scene: Scene, *, share: float) -> np.ndarray:
    """Both sides of the stick's outline from the pivot to a share of its length.

    The outline of a cylinder is where the planes through the lens touch it, which is exact in
    perspective too.

    Returns:
        Pixels, shape (2, K, 2), from the pivot down; K is 2, or more if the lens bends lines.
    """
    down = direction(state.inclination)
    sides = _touching_radii(state.pivot, down, camera.position, scene.stick_radius)
    points = 9 if any(camera.distortion) else 2
    axis = state.pivot + np.outer(np.linspace(0.0, share * scene.stick_length, points), down)
    return camera.project(axis[None] + sides[:, None])


def _touching_radii(
    pivot: np.ndarray, down: np.ndarray, eye: np.ndarray, radius: float
) -> np.ndarray:
    """Radii [m], shape (2, 3), from the axis to the two lines at which a view touches a rod."""
    towards = (eye - pivot) - ((eye - pivot) @ down) * down
    distance = float(np.linalg.norm(towards))
    towards = towards / distance
    aside = np.cross(down, towards)
    cosine = radius / distance
    sine = np.sqrt(1.0 - cosine**2)
    return radius * np.stack([cosine * towards + sine * aside, cosine * towards - sine * aside])


def submerged_outline(
    state: WorldState, camera: CameraModel, scene: Scene, points: int = 6
) -> np.ndarray | None:
    """Outline of the image of the stick below the surface, as the round wall refracts it.

    Every point of the axis is moved to its paraxial image through the cylinder of liquid: with
    s the depth behind the front wall and R the radius, the image lies n s / (n - (n-1) s/R) / n
    behind the wall, and is n / (n - (n-1) s/R) times as far aside and as wide. The thin glass is
    left out, and so is the view through the surface from above. This is right near the cup's
    middle and an approximation towards its sides.

    Returns:
        Pixels, shape (2 `points`, 2), down one side and up the other; None when nothing is below.
    """
    entry = surface_share(state, scene)
    if entry >= 1.0:
        return None
    shares = np.linspace(entry, 1.0, points)
    axis = state.pivot + np.outer(shares * scene.stick_length, direction(state.inclination))
    view = camera.position * [1.0, 1.0, 0.0]
    front = view / np.linalg.norm(view)
    aside = np.array([-front[1], front[0], 0.0])
    behind = scene.cup_radius - axis @ front
    index, radius = scene.refractive_index, scene.cup_radius
    magnified = index / (index - (index - 1.0) * behind / radius)
    apparent_depth = behind * magnified / index
    image = (
        np.outer(radius - apparent_depth, front)
        + np.outer(magnified * (axis @ aside), aside)
        + np.outer(axis[:, 2], [0.0, 0.0, 1.0])
    )
    wide = np.outer(magnified * scene.stick_radius, aside)
    kept = np.hypot(axis[:, 0], axis[:, 1]) < radius
    if kept.sum() < 2:
        return None
    return camera.project(np.concatenate([(image + wide)[kept], (image - wide)[kept][::-1]]))
