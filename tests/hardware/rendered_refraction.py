"""The stick below the liquid's surface, as the round wall refracts it, drawn into a picture."""

import cv2
import numpy as np
from bolfi_liquids.hardware.rendering.drawing import (
    SUBPIXEL_BITS,
    Stage,
    develop,
    draw,
    fixed_point,
    surface_share,
    window_around,
)
from bolfi_liquids.hardware.rendering.world import WorldState, direction
from bolfi_liquids.hardware.vision.camera_model import CameraModel
from bolfi_liquids.hardware.vision.stick_view import Scene, circle

REFRACTIVE_INDEX = 1.33


def refracted(stage: Stage, state: WorldState, rng: np.random.Generator) -> np.ndarray:
    """A picture as `render` makes it, through whose liquid the stick is seen."""
    image, scene, camera = draw(stage, [state]), stage.scene, stage.camera
    outline = submerged_outline(state, camera, scene)
    if outline is None or not np.isfinite(outline).all():
        return develop(stage, image, rng)
    body = np.concatenate([circle(scene.cup_radius, 0.0), circle(scene.cup_radius, scene.fill)])
    hull = cv2.convexHull(camera.project(body).astype(np.float32))
    liquid = np.zeros(image.shape, np.uint8)
    cv2.fillConvexPoly(liquid, fixed_point(hull[:, 0]), 255, shift=SUBPIXEL_BITS)
    window = window_around(outline, camera.size)
    rows, columns = slice(window.top, window.bottom), slice(window.left, window.right)
    drawn = image.copy()
    grey = 0.7 * stage.look.stick + 0.3 * stage.look.liquid
    cv2.fillPoly(drawn, [fixed_point(outline)], int(grey), cv2.LINE_AA, SUBPIXEL_BITS)
    wet = liquid[rows, columns] > 0
    image[rows, columns][wet] = drawn[rows, columns][wet]
    return develop(stage, image, rng)


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
    index, radius = REFRACTIVE_INDEX, scene.cup_radius
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
