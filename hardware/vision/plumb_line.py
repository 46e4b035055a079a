"""Roll of a camera from a picture of a plumb line."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .camera_model import CameraModel
from .coarse_search import Ray, Rows, sampled_rows, search_rays
from .opencv import opencv
from .stick_line import Line, fit_line

DARK = -1.0  # sign of the thread's contrast
LEAST_RESPONSE = 8.0  # grey levels
START_STEP = 3.0  # px
SEARCH_WIDTH = 9  # px
FLANK_WIDTH = 6  # px beside the thread that show the background
LEAST_SHARE = 0.5  # of the rows
MOST_ERROR = np.radians(0.2)


class PlumbLineError(ValueError):
    """The picture shows no plumb line that can be used."""


class Levelled(NamedTuple):
    """A camera put right by a plumb line.

    Attributes:
        camera: With corrected orientation.
        roll: By which the camera was found to be rolled, against its model, clockwise as the
            camera sees it [rad].
        error: Standard error [rad].
    """

    camera: CameraModel
    roll: float
    error: float


def level_camera(image: np.ndarray, camera: CameraModel, *, width: float = 4.0) -> Levelled:
    """Roll a camera about its line of sight so that a plumb line is vertical.

    Args:
        image: Grey levels, uint8; a thread hangs through most of its height, in front of an even
            background that is brighter.
        camera: Whose pitch and yaw are right or nearly so.
        width: Of the thread [px], about.

    Raises:
        PlumbLineError: there is no thread, or too little of it.
    """
    from scipy.spatial.transform import Rotation

    if image.shape != camera.size[::-1]:
        raise PlumbLineError(
            f"the picture has shape {image.shape}, the camera model {camera.size[::-1]}"
        )
    line = _thread(image, camera, width)
    roll = -_correction(line, camera)
    turned = replace(camera, rotation=Rotation.from_euler("z", -roll).as_matrix() @ camera.rotation)
    return Levelled(turned, roll, line.slope_error / (1.0 + line.slope**2))


def _correction(line: Line, camera: CameraModel) -> float:
    """Angle about the line of sight that turns the model's vertical into the line's plane.

    With the plane's normal n and the vertical g, both in the camera frame, n . Rz(angle) g = 0.
    """
    normal = np.array([1.0, -line.slope, -line.offset])
    down = camera.rotation @ [0.0, 0.0, -1.0]
    a = normal[0] * down[0] + normal[1] * down[1]
    b = normal[1] * down[0] - normal[0] * down[1]
    c = normal[2] * down[2]
    size = float(np.hypot(a, b))
    if not size > abs(c):
        raise PlumbLineError("the camera looks straight up or down: a plumb line shows no roll")
    # a cos + b sin = -c has two roots; the other one is upside down
    middle, half = np.arctan2(b, a), np.arccos(-c / size)
    roots = (np.array([middle - half, middle + half]) + np.pi) % (2 * np.pi) - np.pi
    return float(roots[np.argmin(np.abs(roots))])


def _thread(image: np.ndarray, camera: CameraModel, width: float) -> Line:
    rows = Rows(0, image.shape[0])
    starts = np.arange(0.0, image.shape[1], START_STEP)
    # blurred to a width that the rays cannot step over
    smooth = opencv().blur(image, (SEARCH_WIDTH, 3))
    lines, middle = sampled_rows(smooth, DARK, rows), 0.5 * image.shape[0]
    far = 2.0 * image.shape[0]
    ray = search_rays(lines, starts, middle, rows, width=SEARCH_WIDTH, length=far)
    if ray.response < LEAST_RESPONSE:
        raise PlumbLineError(
            "no plumb line was found: hang a thread, dark before a bright background, through "
            "the whole picture"
        )
    points = _centroids(image, ray, width)
    line = fit_line(camera.undistort(points))
    count = int(line.inlier.sum())
    if count < LEAST_SHARE * image.shape[0] or line.slope_error > MOST_ERROR:
        raise PlumbLineError(
            f"the plumb line is seen in {count} of {image.shape[0]} rows; it must be straight and "
            "free over at least half of them"
        )
    return line


def _centroids(image: np.ndarray, ray: Ray, width: float) -> np.ndarray:
    """Middle of the thread in each row [px], shape (N, 2), where it stands out."""
    row = np.arange(image.shape[0])
    reach = int(np.ceil(0.5 * width + FLANK_WIDTH))
    centre = np.rint(ray.column + ray.slope * (row - ray.row)).astype(np.intp)
    inside = (centre >= reach) & (centre < image.shape[1] - reach)
    row, centre = row[inside], centre[inside]
    offsets = np.arange(-reach, reach + 1)
    strength = DARK * image[row[:, None], centre[:, None] + offsets].astype(np.float64)
    flank = np.abs(offsets) > reach - FLANK_WIDTH // 2
    level, scatter = strength[:, flank].mean(axis=1), strength[:, flank].std(axis=1)
    above = np.maximum(strength - level[:, None] - 2.0 * np.median(scatter), 0.0)
    mass = above.sum(axis=1)
    clear = mass > 0.3 * np.median(mass) if len(mass) else mass > 0
    middle = centre[clear] + (above @ offsets)[clear] / mass[clear]
    return np.column_stack([middle, row[clear]])
