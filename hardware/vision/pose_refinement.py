"""A camera's pose refined by the marker's pixels while the robot moves."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from .camera_model import CameraModel

ANGLE_PRIOR = np.radians(3.0)
SHIFT_PRIOR = 0.01  # m
PIXEL_NOISE = 0.1  # px; less than the truth of any real lens model
LEAST_FRAMES = 30


class PoseError(ValueError):
    """A camera's pose cannot be refined from these frames."""


class RefinedPose(NamedTuple):
    """What `refine_orientation` found.

    Attributes:
        camera: With the new pose.
        turned: Angles by which it was turned about its own x, y and z axes [rad], shape (3,).
        turned_error: Their standard errors [rad].
        shift: By which it was moved [m], shape (3,).
        shift_error: Their standard errors [m].
        residual: Left between marker and path [px], root mean square.
    """

    camera: CameraModel
    turned: np.ndarray
    turned_error: np.ndarray
    shift: np.ndarray
    shift_error: np.ndarray
    residual: float


def refine_orientation(
    camera: CameraModel,
    pixels: np.ndarray,
    places: np.ndarray,
    *,
    angle_prior: float = ANGLE_PRIOR,
    shift_prior: float = SHIFT_PRIOR,
) -> RefinedPose:
    """Turn and move a camera so that the marker is where the robot says.

    The yaw tells most: two degrees of it let a stick that leans by 10 degrees in one plane seem
    to lean by 0.35 degrees in the other. A motion in a horizontal plane shows it badly; let the
    gripper also move up and down, by 5 cm or more, and towards and away from the camera.

    Args:
        camera: As measured by hand.
        pixels: Of the marker [px], shape (N, 2); rows that are not finite are skipped.
        places: Of the marker in the cup frame at the same times [m], shape (N, 3).
        angle_prior: How well each angle is known from the start [rad].
        shift_prior: How well each coordinate of the position is known [m].

    Raises:
        PoseError: fewer than 30 finite rows, or a marker behind the camera.
    """
    seen = np.isfinite(pixels).all(axis=1) & np.isfinite(places).all(axis=1)
    if seen.sum() < LEAST_FRAMES:
        raise PoseError(f"{int(seen.sum())} frames show the marker; the pose needs {LEAST_FRAMES}")
    pixels, places = pixels[seen], places[seen]
    if not np.isfinite(camera.project(places)).all():
        raise PoseError("the marker is behind the camera; correct its position by hand first")
    prior = np.repeat([angle_prior, shift_prior], 3)

    def misfit(change: np.ndarray) -> np.ndarray:
        moved = camera.turned(change[:3], change[3:])
        return (moved.project(places) - pixels).ravel()

    def residuals(scaled: np.ndarray) -> np.ndarray:
        return np.concatenate([misfit(scaled * prior) / PIXEL_NOISE, scaled])

    found = least_squares(residuals, np.zeros(6), loss="soft_l1", f_scale=3.0)
    change = found.x * prior
    left = misfit(change)
    usual = 1.4826 * float(np.median(np.abs(left)))
    noise = max(usual / PIXEL_NOISE, 1.0)
    errors = noise * prior * np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    return RefinedPose(
        camera=camera.turned(change[:3], change[3:]),
        turned=change[:3],
        turned_error=errors[:3],
        shift=change[3:],
        shift_error=errors[3:],
        residual=float(np.sqrt(np.mean(left[np.abs(left) < 6.0 * usual + 1e-9] ** 2))),
    )
