"""Delay of a camera, from the exposure to the stamp, by where the marker is in the pictures."""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ..motion.poses import Trajectory
from .camera_model import CameraModel
from .inclination import FrameSeries

SEARCH_RANGE = 0.5  # s on both sides of none
SEARCH_STEP = 0.01  # s
MAX_ROUNDS = 15
HUBER_SDS = 1.5  # standard deviations
OUTLIER_SDS = 6.0
HUBER_ROUNDS = 10
STEP_TOLERANCE = 1e-6  # s; smaller steps end the search
MIN_FRAMES = 30
MIN_SPEED = 5.0  # px/s, root mean square: slower, and the pictures tell nothing about time
MIN_NOISE = 0.01  # px


class DelayError(ValueError):
    """The pictures do not determine the camera's delay; the message says why."""


class Delay(NamedTuple):
    """Delay of a camera: time of the exposure = stamp - delay.

    Attributes:
        delay: [s].
        error: Its standard error [s].
        residual: What is left between the marker and the robot's path [px], root mean square of
            the frames that fit.
        misfit: How far the marker lies from where the rig's numbers put it [px], root mean
            square. Much more than `residual` means that the camera has been moved, or that its
            position, orientation or marker offset is wrong.
    """

    delay: float
    error: float = float("nan")
    residual: float = float("nan")
    misfit: float = float("nan")


def fit_delay(
    series: FrameSeries,
    gripper: Trajectory,
    camera: CameraModel,
    marker_offset: tuple[float, float, float],
) -> Delay:
    """Delay of a camera, between -`SEARCH_RANGE` and `SEARCH_RANGE`.

    The marker's pixels are regressed on the projected path of the gripper, by Gauss-Newton with
    Huber's weights. A constant and a linear function of the gripper's position are fitted along:
    they take up a camera that stands or looks a little otherwise than its model says, which
    would pass for a delay where the path prefers one sense of turning.

    Args:
        series: Of one view, its stamps on the robot's clock.
        gripper: The robot's samples; times without finite position are skipped.
        camera: Of the view.
        marker_offset: From the pivot to the marker [m].

    Raises:
        DelayError: too few frames show the marker while the robot was sampled, or the gripper
            hardly moves in the picture.
    """
    path = _path(gripper, camera, marker_offset)
    seen = _seen(series, path)
    pixels, stamp = series.marker[seen], series.stamp[seen]
    delay = _search(stamp, pixels, path)
    for _ in range(MAX_ROUNDS):
        later, found = _linear_fit(stamp - delay, pixels, path)
        delay -= later
        if abs(later) < STEP_TOLERANCE:
            return found._replace(delay=delay)
    raise DelayError(
        f"the delay did not settle in {MAX_ROUNDS} rounds: is the marker's offset right, and does "
        "the robot's time advance evenly?"
    )


class _Path(NamedTuple):
    """The marker's way through the picture, and the gripper's in space, over robot time."""

    pixels: CubicSpline
    position: CubicSpline
    middle: np.ndarray
    first: float
    last: float


def _path(
    gripper: Trajectory, camera: CameraModel, marker_offset: tuple[float, float, float]
) -> _Path:
    time, position = np.asarray(gripper.time), np.asarray(gripper.position)
    finite = np.isfinite(position).all(axis=1) & np.isfinite(time)
    time, position = time[finite], position[finite]
    if len(time) < 4 or not (np.diff(time) > 0).all():
        raise DelayError(
            f"the robot gave {len(time)} finite samples; a delay needs at least 4, with times "
            "that rise"
        )
    pixels = camera.project(position + np.array(marker_offset))
    if not np.isfinite(pixels).all():
        raise DelayError("the gripper is behind the camera; check the camera's pose")
    return _Path(
        CubicSpline(time, pixels),
        CubicSpline(time, position),
        position.mean(axis=0),
        float(time[0]),
        float(time[-1]),
    )


def _seen(series: FrameSeries, path: _Path) -> np.ndarray:
    """Frames that show the marker while the robot was surely sampled."""
    time = series.stamp
    sampled = (time > path.first + SEARCH_RANGE) & (time < path.last - SEARCH_RANGE)
    seen = sampled & np.isfinite(series.marker).all(axis=1)
    if seen.sum() < MIN_FRAMES:
        raise DelayError(
            f"only {int(seen.sum())} frames show the marker while the robot was sampled; the "
            f"delay needs {MIN_FRAMES}. Check that the marker is in view"
        )
    speed = path.pixels(time[seen], 1)
    if not np.sqrt(np.mean(np.sum(speed**2, axis=1))) > MIN_SPEED:
        raise DelayError("the gripper hardly moves in the picture: record a motion for the delay")
    return seen


def _search(stamp: np.ndarray, pixels: np.ndarray, path: _Path) -> float:
    """Delay [s] on a grid; constant pixel differences are left out of account."""
    delays = np.arange(-SEARCH_RANGE, SEARCH_RANGE + SEARCH_STEP / 2, SEARCH_STEP)

    def apart(delay: float) -> float:
        difference = pixels - path.pixels(stamp - delay)
        return float(np.abs(difference - np.median(difference, axis=0)).sum())

    return float(min(delays, key=apart))


def _linear_fit(time: np.ndarray, pixels: np.ndarray, path: _Path) -> tuple[float, Delay]:
    """One round: by how much the exposures were later than `time` [s], and the fit's numbers.

    The problem is made linear about `time` and solved with Huber's weights.
    """
    target = (pixels - path.pixels(time)).T.ravel()
    columns = _columns(path, time)
    solution, left = np.zeros(columns.shape[1]), target
    weight, normal = np.ones(len(target)), np.eye(columns.shape[1])
    for _ in range(HUBER_ROUNDS):
        noise = max(1.4826 * float(np.median(np.abs(left))), MIN_NOISE)
        weight = np.minimum(1.0, HUBER_SDS * noise / np.maximum(np.abs(left), 1e-12))
        weight[np.abs(left) > OUTLIER_SDS * noise] = 0.0
        weighted = columns * weight[:, None] / noise**2
        normal = weighted.T @ columns
        solution = np.linalg.solve(normal, weighted.T @ target)
        left = target - columns @ solution
    kept = weight > 0
    return float(solution[0]), Delay(
        delay=float("nan"),
        error=float(np.sqrt(np.linalg.inv(normal)[0, 0])),
        residual=float(np.sqrt(np.mean(left[kept] ** 2))),
        misfit=float(np.sqrt(np.mean(target[kept] ** 2))),
    )


def _columns(path: _Path, time: np.ndarray) -> np.ndarray:
    """Derivatives of both pixel coordinates, shape (2 N, 1 + 2 K): time first, then the pose."""
    speed = path.pixels(time, 1)
    place = path.position(time) - path.middle
    moves = np.ptp(place, axis=0) > 1e-3  # along the others a linear function is a constant
    pose = np.column_stack([np.ones(len(time)), 100.0 * place[:, moves]])
    nothing = np.zeros_like(pose)
    return np.vstack(
        [
            np.column_stack([speed[:, 0], pose, nothing]),
            np.column_stack([speed[:, 1], nothing, pose]),
        ]
    )
