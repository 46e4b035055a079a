"""Waiting paths, the running path and recent set-points."""

from typing import NamedTuple

import numpy as np

from ..motion.stir_paths import PosePath


class Leg(NamedTuple):
    """A checked path, as the `number`th order from 0.

    Attributes:
        number: Of the order.
        path: As it was ordered.
        base: Its poses in the base frame, shape (T, 6).
    """

    number: int
    path: PosePath
    base: np.ndarray


class Course(NamedTuple):
    """What is commanded now: sample `at` of `leg`, or the pose `hold` when there is none.

    Attributes:
        hold: Latest set-point in the base frame, shape (6,).
        leg: The path that runs.
        at: Its sample.
        waiting: Paths that come after it.
    """

    hold: np.ndarray
    leg: Leg | None = None
    at: int = 0
    waiting: tuple[Leg, ...] = ()


class LegChange(NamedTuple):
    """What a period brought: the path that ended, the path that began."""

    done: Leg | None
    began: Leg | None


def queued(course: Course, leg: Leg) -> Course:
    """With one path more."""
    return course._replace(waiting=(*course.waiting, leg))


def advanced(course: Course) -> tuple[Course, LegChange]:
    """One period later. A tick that came late delays the path; it never hurries it."""
    leg = course.leg
    if leg is not None and course.at + 1 < len(leg.base):
        at = course.at + 1
        return course._replace(at=at, hold=leg.base[at]), LegChange(None, None)
    if course.waiting:
        first, *rest = course.waiting
        # what is commanded already is not commanded again: joined paths keep their time
        at = 1 if np.array_equal(first.base[0], course.hold) else 0
        moved = Course(first.base[at], leg=first, at=at, waiting=tuple(rest))
        return moved, LegChange(leg, first)
    return course._replace(leg=None), LegChange(leg, None)


class Trail:
    """The set-points of the last moment, and how far the arm is from them.

    The arm follows its set-points with a lag, so the nearest of them counts.
    """

    def __init__(self, pose: np.ndarray, samples: int):
        self._position = np.tile(pose[:3], (samples, 1))
        self._turn = np.tile(quaternion(pose[3:]), (samples, 1))
        self._next = 0

    def put(self, pose: np.ndarray) -> None:
        """Add a set-point; the oldest is forgotten."""
        self._position[self._next] = pose[:3]
        self._turn[self._next] = quaternion(pose[3:])
        self._next = (self._next + 1) % len(self._position)

    def error(self, pose: np.ndarray) -> tuple[float, float]:
        """Distance [m] and angle [rad] from the nearest set-points."""
        away = self._position - pose[:3]
        nearest = float(np.sqrt(np.einsum("ij,ij->i", away, away).min()))
        alike = float(np.abs(self._turn @ quaternion(pose[3:])).max())
        return nearest, 2.0 * float(np.arccos(min(alike, 1.0)))


def quaternion(rotvec: np.ndarray) -> np.ndarray:
    """Unit quaternion (w, x, y, z) of a rotation vector [rad]."""
    angle = float(np.linalg.norm(rotvec))
    scale = np.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return np.array([np.cos(0.5 * angle), *(scale * np.asarray(rotvec))])
