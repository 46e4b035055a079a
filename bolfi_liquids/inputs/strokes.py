"""Strokes of a stir, and the speed of its gripper."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .recording import Recording

MOVING_SHARE = 0.5
"""Share of the greatest speed above which the gripper moves: it rests too shortly at corners."""
EVEN_PARTS = 8
"""Parts into which a stir without separate strokes is cut."""


class Stroke(NamedTuple):
    """A stretch of a recording.

    Attributes:
        number: From 1; 0 before the first, and after the last one more than there are.
        samples: bool (T,).
    """

    number: int
    samples: NDArray[np.bool_]


def speed(recording: Recording) -> NDArray[np.float64]:
    """Speed of the gripper at each sample [m/s], shape (T,)."""
    velocity = np.gradient(recording.gripper.position, recording.time, axis=0)
    return np.linalg.norm(velocity, axis=1)


def resting(recording: Recording) -> NDArray[np.bool_]:
    """Samples before the gripper first moves, bool (T,)."""
    from ..models.trajectory import resting as samples_at_rest

    return np.arange(len(recording.time)) < samples_at_rest(recording.gripper)


def strokes(recording: Recording) -> list[Stroke]:
    """The recording cut where the gripper stands still, or evenly where it never does."""
    fast = speed(recording)
    moving = fast > MOVING_SHARE * fast.max()
    begins = moving & ~np.append(False, moving[:-1])
    number = np.cumsum(begins)
    count = int(number[-1])
    if count < 2:
        edges = np.linspace(recording.time[0], recording.time[-1], EVEN_PARTS + 1)[1:-1]
        number = 1 + np.digitize(recording.time, edges)
        count = EVEN_PARTS
    else:
        after = np.flatnonzero(moving)[-1]
        number[after + 1 :] = count + 1
    numbers = range(int(number.min()), int(number.max()) + 1)
    return [Stroke(k, number == k) for k in numbers if (number == k).any()]


def stroke_numbers(recording: Recording) -> NDArray[np.int64]:
    """Number of the stroke that each sample belongs to, shape (T,)."""
    numbers = np.zeros(len(recording.time), np.int64)
    for stroke in strokes(recording):
        numbers[stroke.samples] = stroke.number
    return numbers
