"""From a camera's stamps to the robot's clock, by where the marker is in the pictures.

A stamp is this computer's time when a picture was grabbed: later than the exposure by the camera's
delay, on a clock that the controller's differs from by a constant and by a slow drift.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ..motion.trajectory import Trajectory
from .camera_model import CameraModel
from .measurement_series import FrameSeries

SEARCH_RANGE = 0.5  # s on both sides of the first guess
SEARCH_STEP = 0.01  # s
MAX_ROUNDS = 15
HUBER_SDS = 1.5  # standard deviations
OUTLIER_SDS = 6.0
HUBER_ROUNDS = 10
STEP_TOLERANCE = 1e-6  # s; smaller steps end the search
LEAST_FRAMES = 30
LEAST_SPEED = 5.0  # px/s, root mean square: slower, and the pictures tell nothing about time
DRIFT_PRIOR = 1e-4  # clocks of computers and cameras differ by some 1e-5
LEAST_NOISE = 0.01  # px


class ClockError(ValueError):
    """The pictures do not tell how the clocks are related; the message says why."""


class Clock(NamedTuple):
    """Robot's time = stamp + offset + drift * (stamp - reference).

    Attributes:
        offset: [s]; the difference of the clocks less the camera's delay.
        drift: The robot's clock runs so much faster than this computer's.
        reference: Stamp at which `offset` holds [s].
        offset_error: Standard error [s].
        drift_error: Standard error.
        residual: What is left between the marker and the robot's path [px], root mean square of
            the frames that fit.
        misfit: How far the marker lies from where the rig's numbers put it [px], root mean
            square. Much more than `residual` means that the camera has been moved, or that its
            position, orientation or marker offset is wrong.
    """

    offset: float
    drift: float = 0.0
    reference: float = 0.0
    offset_error: float = float("nan")
    drift_error: float = float("nan")
    residual: float = float("nan")
    misfit: float = float("nan")

    def to_robot(self, stamp: np.ndarray) -> np.ndarray:
        """Times of the robot's clock [s] of stamps [s]."""
        return stamp + self.offset + self.drift * (stamp - self.reference)

    def to_camera(self, time: np.ndarray) -> np.ndarray:
        """Stamps [s] of times of the robot's clock [s]."""
        elapsed = (time - self.reference - self.offset) / (1.0 + self.drift)
        return self.reference + elapsed


def fit_clock(
    series: FrameSeries,
    gripper: Trajectory,
    camera: CameraModel,
    marker_offset: tuple[float, float, float],
    *,
    guess: float,
) -> Clock:
    """Offset and drift from a camera's stamps to the robot's clock.

    The marker's pixels are regressed on the projected path of the gripper, by Gauss-Newton with
    Huber's weights. A constant and a linear function of the gripper's position are fitted along:
    they take up a camera that stands or looks a little otherwise than its model says, which
    would pass for a delay where the path prefers one sense of turning.

    Args:
        series: Of one view.
        gripper: The robot's samples; times without finite position are skipped.
        camera: Of the view.
        marker_offset: From the pivot to the marker [m].
        guess: Robot's time minus stamp [s], right to `SEARCH_RANGE`; the median difference of the
            robot's time and this computer's in its samples will do.

    Raises:
        ClockError: too few frames show the marker while the robot was sampled, or the gripper
            hardly moves in the picture.
    """
    path = _path(gripper, camera, marker_offset)
    seen = _seen(series, path, guess)
    pixels, stamp = series.marker[seen], series.stamp[seen]
    reference = float(stamp.mean())
    start = _search(stamp + guess, pixels, path)
    state = np.array([guess + start, 0.0])
    for _ in range(MAX_ROUNDS):
        fit = _linear_fit(state, stamp - reference, stamp, pixels, path)
        state = state + fit.step
        if np.abs(fit.step[0]) < STEP_TOLERANCE:
            errors = np.sqrt(np.diag(fit.covariance))
            return Clock(*state.tolist(), reference, *errors.tolist(), fit.residual, fit.misfit)
    raise ClockError(
        f"the clocks did not settle in {MAX_ROUNDS} rounds: is the marker's offset right, and does "
        "the robot's time advance evenly?"
    )


class _ClockStep(NamedTuple):
    """Step of offset and drift, their covariance, and what is left [px]."""

    step: np.ndarray
    covariance: np.ndarray
    residual: float
    misfit: float


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
        raise ClockError(
            f"the robot gave {len(time)} finite samples; the clocks need at least 4, with times "
            "that rise"
        )
    pixels = camera.project(position + np.array(marker_offset))
    if not np.isfinite(pixels).all():
        raise ClockError("the gripper is behind the camera; check the camera's pose")
    return _Path(
        CubicSpline(time, pixels),
        CubicSpline(time, position),
        position.mean(axis=0),
        float(time[0]),
        float(time[-1]),
    )


def _seen(series: FrameSeries, path: _Path, guess: float) -> np.ndarray:
    """Frames that show the marker while the robot was surely sampled."""
    time = series.stamp + guess
    sampled = (time > path.first + SEARCH_RANGE) & (time < path.last - SEARCH_RANGE)
    seen = sampled & np.isfinite(series.marker).all(axis=1)
    if seen.sum() < LEAST_FRAMES:
        raise ClockError(
            f"only {int(seen.sum())} frames show the marker while the robot was sampled; the "
            f"clocks need {LEAST_FRAMES}. Check that the marker is in view, and the two clocks' "
            f"first guess ({guess:.3f} s)"
        )
    speed = path.pixels(time[seen], 1)
    if not np.sqrt(np.mean(np.sum(speed**2, axis=1))) > LEAST_SPEED:
        raise ClockError("the gripper hardly moves in the picture: record a motion for the clocks")
    return seen


def _search(time: np.ndarray, pixels: np.ndarray, path: _Path) -> float:
    """Shift [s] of the guess, on a grid; constant pixel differences are left out of account."""
    shifts = np.arange(-SEARCH_RANGE, SEARCH_RANGE + SEARCH_STEP / 2, SEARCH_STEP)

    def apart(shift: float) -> float:
        difference = pixels - path.pixels(time + shift)
        return float(np.abs(difference - np.median(difference, axis=0)).sum())

    return float(min(shifts, key=apart))


def _linear_fit(
    state: np.ndarray, elapsed: np.ndarray, stamp: np.ndarray, pixels: np.ndarray, path: _Path
) -> _ClockStep:
    """One round: the problem made linear about `state`, solved with Huber's weights."""
    time = stamp + state[0] + state[1] * elapsed
    target = (pixels - path.pixels(time)).T.ravel()
    columns = _columns(path, time, elapsed)
    prior = np.zeros(columns.shape[1])
    prior[1] = 1.0 / DRIFT_PRIOR**2
    solution, left = np.zeros(columns.shape[1]), target
    weight, normal = np.ones(len(target)), np.eye(columns.shape[1])
    for _ in range(HUBER_ROUNDS):
        noise = max(1.4826 * float(np.median(np.abs(left))), LEAST_NOISE)
        weight = np.minimum(1.0, HUBER_SDS * noise / np.maximum(np.abs(left), 1e-12))
        weight[np.abs(left) > OUTLIER_SDS * noise] = 0.0
        weighted = columns * weight[:, None] / noise**2
        normal = weighted.T @ columns + np.diag(prior)
        right = weighted.T @ target
        right[1] -= prior[1] * state[1]
        solution = np.linalg.solve(normal, right)
        left = target - columns @ solution
    kept = weight > 0
    return _ClockStep(
        step=solution[:2],
        covariance=np.linalg.inv(normal)[:2, :2],
        residual=float(np.sqrt(np.mean(left[kept] ** 2))),
        misfit=float(np.sqrt(np.mean(target[kept] ** 2))),
    )


def _columns(path: _Path, time: np.ndarray, elapsed: np.ndarray) -> np.ndarray:
    """Derivatives of both pixel coordinates, shape (2 N, 2 + 2 K): time first, then the pose."""
    speed = path.pixels(time, 1)
    place = path.position(time) - path.middle
    moves = np.ptp(place, axis=0) > 1e-3  # along the others a linear function is a constant
    pose = np.column_stack([np.ones(len(time)), 100.0 * place[:, moves]])
    nothing = np.zeros_like(pose)
    return np.vstack(
        [
            np.column_stack([speed[:, 0], speed[:, 0] * elapsed, pose, nothing]),
            np.column_stack([speed[:, 1], speed[:, 1] * elapsed, nothing, pose]),
        ]
    )
