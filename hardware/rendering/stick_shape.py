"""Outline of the stick in the picture, above the liquid's surface."""

import numpy as np

from ..vision.camera_model import CameraModel
from ..vision.stick_view import Scene
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
