"""A calibrated camera: where it stands, and how it maps points of the cup frame to pixels."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..errors import missing_extra

UNDISTORT_UNTIL = 20, 1e-9  # iterations, or an error of the picture [px]
SHAPES = {
    "focal": (2,),
    "centre": (2,),
    "size": (2,),
    "rotation": (3, 3),
    "position": (3,),
    "distortion": (5,),
}


@cache
def opencv() -> ModuleType:
    """The module `cv2`, told to use one thread, as every camera has a process of its own.

    Raises:
        ImportError: OpenCV is not installed; the message names the extra that brings it.
    """
    try:
        import cv2
    except ModuleNotFoundError as err:
        raise missing_extra("OpenCV", "cameras", "a camera") from err
    cv2.setNumThreads(1)
    # what it warns of, our own errors say with the camera's name
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    return cv2


class CameraModelError(ValueError):
    """A camera's numbers cannot describe a camera."""


@dataclass(frozen=True, eq=False)
class CameraModel:
    """Pinhole with the five distortion coefficients of OpenCV.

    The camera frame has x to the right, y down and z forward.

    Attributes:
        focal: fx and fy [px].
        centre: cx and cy [px].
        size: Width and height of the image [px].
        rotation: Turns vectors of the cup frame into the camera frame, shape (3, 3).
        position: Of the lens in the cup frame [m], shape (3,).
        distortion: k1, k2, p1, p2, k3.

    Raises:
        CameraModelError: a number is not finite, the focal length not positive, or `rotation` is
            no rotation.
    """

    focal: tuple[float, float]
    centre: tuple[float, float]
    size: tuple[int, int]
    rotation: np.ndarray
    position: np.ndarray
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for fault in self._faults():
            raise CameraModelError(f"the camera's {fault}")
        for name in ("rotation", "position"):
            value = np.array(getattr(self, name), dtype=float)
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def _faults(self) -> Iterator[str]:
        """Each rule needs what those before it have found right."""
        for name, shape in SHAPES.items():
            given = getattr(self, name)
            given = given.tolist() if isinstance(given, np.ndarray) else given
            try:
                value = np.asarray(given, dtype=float)
                right = value.shape == shape and bool(np.isfinite(value).all())
            except (TypeError, ValueError):  # texts, or rows of different lengths
                right = False
            if not right:
                yield f"{name} must be finite with shape {shape}, got {given!r:.200}"
        if min(*self.focal, *self.size) <= 0:
            yield f"focal length and size must be positive, got {self.focal} and {self.size}"
        turn = np.asarray(self.rotation, dtype=float)
        if not (np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) and np.linalg.det(turn) > 0):
            yield f"rotation must have right-handed unit vectors as rows, got {turn.tolist()}"

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """Points of the cup frame [m], shape (..., 3), in the camera frame."""
        return (np.asarray(points, dtype=float) - self.position) @ self.rotation.T

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points of the cup frame.

        Args:
            points: In the cup frame [m], shape (N, 3).

        Returns:
            Columns and rows [px], shape (N, 2); NaN for points behind the camera.
        """
        points = np.asarray(points, dtype=float)
        if not points.size:  # OpenCV refuses none
            return np.empty((*points.shape[:-1], 2))
        turn, _ = opencv().Rodrigues(self.rotation)
        shift = -self.rotation @ self.position
        found, _ = opencv().projectPoints(
            points.reshape(-1, 1, 3), turn, shift, self.matrix, np.array(self.distortion)
        )
        pixels = found.reshape(*points.shape[:-1], 2)
        in_front = self.to_camera(points)[..., 2:] > 0
        return np.where(in_front, pixels, np.nan)

    @property
    def matrix(self) -> np.ndarray:
        """OpenCV's camera matrix [px], shape (3, 3)."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def undistort(self, pixels: np.ndarray) -> np.ndarray:
        """Undistorted normalised coordinates (x / z, y / z) of pixels, both of shape (..., 2)."""
        pixels = np.asarray(pixels, dtype=float)
        if not (pixels.size and any(self.distortion)):
            return (pixels - self.centre) / self.focal
        cv2 = opencv()
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, *UNDISTORT_UNTIL)
        found = cv2.undistortPoints(
            pixels.reshape(-1, 1, 2), self.matrix, np.array(self.distortion), criteria=criteria
        )
        return found.reshape(pixels.shape)

    def place(self, pixel: np.ndarray, depth: float) -> np.ndarray:
        """The point [m], shape (3,), of the cup frame at a pixel and a depth in front [m]."""
        x, y = self.undistort(pixel)
        return self.position + depth * (np.array([x, y, 1.0]) @ self.rotation)

    def depth(self, point: np.ndarray) -> float:
        """Distance of a point of the cup frame along the line of sight [m]."""
        return float(self.rotation[2] @ (np.asarray(point) - self.position))


def look_at(position: np.ndarray, target: np.ndarray, roll: float = 0.0) -> np.ndarray:
    """Orientation of a camera that looks from one point of the cup frame at another.

    Args:
        position: Of the lens [m], shape (3,).
        target: In the middle of the picture [m], shape (3,).
        roll: Of the camera about its line of sight, clockwise as the camera sees it [rad]; an
            upright thing then leans to the left in the picture.

    Raises:
        CameraModelError: the line of sight is vertical or has no length.
    """
    from scipy.spatial.transform import Rotation

    forward = np.asarray(target, dtype=float) - np.asarray(position, dtype=float)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if not np.linalg.norm(right) > 1e-9:
        raise CameraModelError(
            f"a camera at {position} cannot look at {target}: move it away from the vertical "
            "through its target"
        )
    right, forward = right / np.linalg.norm(right), forward / np.linalg.norm(forward)
    level = np.stack([right, np.cross(forward, right), forward])
    return Rotation.from_euler("z", -roll).as_matrix() @ level


def as_fields(camera: CameraModel) -> dict[str, Any]:
    """A camera as JSON can hold it."""
    return {name: np.asarray(getattr(camera, name)).tolist() for name in SHAPES}


def from_fields(fields: Mapping[str, Any]) -> CameraModel:
    """Undoes `as_fields`.

    Raises:
        KeyError, TypeError, ValueError: They describe no camera.
    """
    values: dict[str, Any] = {name: tuple(fields[name]) for name in SHAPES}
    return CameraModel(**values)


def write_camera(camera: CameraModel, path: Path) -> None:
    """Write a camera as JSON."""
    path.write_text(json.dumps(as_fields(camera), indent=1) + "\n")


def read_camera(path: Path) -> CameraModel:
    """Read a camera that `write_camera` wrote.

    Raises:
        CameraModelError: the file is no JSON, a field is missing, or it describes no camera.
        OSError: the file cannot be read.
    """
    try:
        return from_fields(json.loads(path.read_text()))
    except (KeyError, TypeError, ValueError) as err:
        raise CameraModelError(
            f"{path} describes no camera ({err}); calibrate this camera again"
        ) from err
