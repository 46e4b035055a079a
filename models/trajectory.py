"""A gripper's measured path, and its positions at the steps of a simulation."""

from typing import Protocol

import numpy as np

MAX_REST_TRAVEL = 1e-4
"""Distance from its first position within which the gripper rests [m]."""


class PivotPath(Protocol):
    """Times [T] in s and pivot positions [T, 3] in m; rows that are not finite are skipped."""

    @property
    def time(self) -> np.ndarray: ...
    @property
    def position(self) -> np.ndarray: ...


def step_path(gripper: PivotPath, step: float) -> np.ndarray:
    """Pivot at the start and at the end of each step [m], shape [steps + 1, 3].

    Each is the mean, over one step, of a smooth curve through the samples. So slow recordings are
    interpolated, and the noise of fast ones does not become acceleration.

    Raises:
        ValueError: fewer than two finite samples, times that do not rise, positions of another
            shape.
    """
    from scipy.interpolate import Akima1DInterpolator

    time, (seen, position) = np.asarray(gripper.time), finite_samples(gripper)
    steps = int(np.ceil((time[-1] - time[0]) / step - 1e-9))
    edges = time[0] + (np.arange(steps + 2) - 0.5) * step
    travelled = Akima1DInterpolator(seen, position, method="makima").antiderivative()
    inside = np.clip(edges, seen[0], seen[-1])
    before, after = edges - inside, position[[0, -1]]
    held = np.where((before < 0.0)[:, None], after[0], after[1]) * before[:, None]
    return np.diff(travelled(inside) + held, axis=0) / step


def top_speed(gripper: PivotPath, step: float) -> float:
    """Top speed of the pivot [m/s] over intervals of a step or a sample, whichever is longer."""
    path = step_path(gripper, step)
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).max(initial=0.0) / step)


def resting(gripper: PivotPath) -> int:
    """Number of samples before the gripper first moves."""
    position = np.asarray(gripper.position)
    start = position[np.isfinite(position).all(axis=1)][0]
    moved = np.linalg.norm(position - start, axis=1) > MAX_REST_TRAVEL  # not where it is NaN
    return int(np.argmax(moved)) if moved.any() else len(moved)


def finite_samples(gripper: PivotPath) -> tuple[np.ndarray, np.ndarray]:
    """Times [n] and positions [n, 3] of the finite samples, two at least."""
    time, position = np.asarray(gripper.time), np.asarray(gripper.position)
    if position.shape != (len(time), 3):
        raise ValueError(
            f"the gripper path has {len(time)} times and positions of shape {position.shape}; "
            f"give shape ({len(time)}, 3)"
        )
    if not (np.diff(time) > 0).all():
        raise ValueError("the gripper path's times must rise from sample to sample")
    finite = np.isfinite(position).all(axis=1)
    if finite.sum() < 2:
        raise ValueError(f"the gripper path has {finite.sum()} finite samples; it needs 2 or more")
    return time[finite], position[finite]
