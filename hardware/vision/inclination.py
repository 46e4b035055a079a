"""The stick's direction in space from its lines in two views."""

from typing import NamedTuple

import numpy as np

from .camera_model import CameraModel


class ViewLines(NamedTuple):
    """The stick's line in one view, at T times; all of shape (T,).

    Attributes:
        angle: From the picture's downward vertical [rad], in undistorted coordinates.
        offset: Where the line crosses the height of the lens' axis, in focal lengths.
        angle_error: Standard error [rad].
        offset_error: Standard error.
    """

    angle: np.ndarray
    offset: np.ndarray
    angle_error: np.ndarray
    offset_error: np.ndarray


class Inclination(NamedTuple):
    """Angles of the stick from the downward vertical in the xz and yz planes.

    Attributes:
        angle: [rad], shape (T, 2), positive towards +x and +y.
        error: Standard errors [rad], shape (T, 2).
    """

    angle: np.ndarray
    error: np.ndarray


def direction(
    xz: ViewLines, yz: ViewLines, camera_xz: CameraModel, camera_yz: CameraModel
) -> np.ndarray:
    """Unit vectors in the cup frame, shape (T, 3), from the pivot down the stick.

    A line in a picture and the lens span a plane that contains the stick; the stick lies where
    both views' planes meet.
    """
    return _meet(_normals(xz.angle, xz.offset, camera_xz), _normals(yz.angle, yz.offset, camera_yz))


def inclination(
    xz: ViewLines, yz: ViewLines, camera_xz: CameraModel, camera_yz: CameraModel
) -> Inclination:
    """Inclinations with standard errors, to first order, from the lines in two views.

    The errors hold for cameras that stand and look as their models say.
    """
    angles = _angles(direction(xz, yz, camera_xz, camera_yz))
    variance = np.zeros_like(angles)
    for changed_xz, changed_yz in _changed(xz, yz):
        moved = _angles(direction(changed_xz, changed_yz, camera_xz, camera_yz))
        variance += (moved - angles) ** 2
    return Inclination(angles, np.sqrt(variance))


def _changed(xz: ViewLines, yz: ViewLines) -> list[tuple[ViewLines, ViewLines]]:
    """Both views, with one number at a time moved by its standard error."""
    return [
        (xz._replace(angle=xz.angle + xz.angle_error), yz),
        (xz._replace(offset=xz.offset + xz.offset_error), yz),
        (xz, yz._replace(angle=yz.angle + yz.angle_error)),
        (xz, yz._replace(offset=yz.offset + yz.offset_error)),
    ]


def _normals(angle: np.ndarray, offset: np.ndarray, camera: CameraModel) -> np.ndarray:
    """Normals in the cup frame, shape (T, 3), of the planes x - slope y - offset z = 0."""
    angle, offset = np.asarray(angle, dtype=float), np.asarray(offset, dtype=float)
    normal = np.stack([np.ones_like(angle), -np.tan(angle), -offset], axis=-1)
    return normal @ camera.rotation


def _meet(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    cross = np.cross(first, second)
    length = np.linalg.norm(cross, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        return cross / length * np.where(cross[..., 2:] > 0, -1.0, 1.0)


def _angles(down: np.ndarray) -> np.ndarray:
    return np.arctan2(down[..., :2], -down[..., 2:])
