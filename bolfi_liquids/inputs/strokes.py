"""Windows of a stir: its strokes in each plane, and stretches of like speed."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .fields import PLANE_NAMES
from .recording import Recording

if TYPE_CHECKING:
    from ..calibration.stir_simulator import Stirring
    from ..inference.criticism import Window

MOVING = 0.5  # of the greatest speed: corners are too short for samples to see them at rest
STILL = 1e-4  # m
PARTS = 8  # of a stir without separate strokes
SPEEDS = 3  # bins


class Stroke(NamedTuple):
    """A stretch of a recording.

    Attributes:
        number: From 1; 0 before the first, and after the last one more than there are.
        samples: bool (T,).
    """

    number: int
    samples: NDArray[np.bool_]


def speed(recording: Recording) -> NDArray[np.float64]:
    """Of the gripper at each sample [m/s], shape (T,)."""
    velocity = np.gradient(recording.gripper.position, recording.time, axis=0)
    return np.linalg.norm(velocity, axis=1)


def resting(recording: Recording) -> NDArray[np.bool_]:
    """Samples before the gripper first moves, bool (T,)."""
    position = recording.gripper.position
    moved = np.linalg.norm(position - position[0], axis=1) > STILL
    return np.cumsum(moved) == 0


def strokes(recording: Recording) -> list[Stroke]:
    """The recording cut where the gripper stands still, or evenly where it never does."""
    fast = speed(recording)
    moving = fast > MOVING * fast.max()
    begins = moving & ~np.append(False, moving[:-1])
    number = np.cumsum(begins)
    count = int(number[-1])
    if count < 2:
        edges = np.linspace(recording.time[0], recording.time[-1], PARTS + 1)[1:-1]
        number = 1 + np.digitize(recording.time, edges)
        count = PARTS
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


def until_stroke(recording: Recording, number: int) -> Recording:
    """The recording as it would be if stirring had ended after a stroke, counted from 1.

    Raises:
        ValueError: There are fewer strokes.
    """
    found = {stroke.number: stroke.samples for stroke in strokes(recording)}
    if number not in found:
        raise ValueError(f"stroke must be one of {', '.join(map(str, found))}, got {number}")
    return recording.first(int(np.flatnonzero(found[number])[-1]) + 1)


def windows(stirring: "Stirring") -> tuple["Window", ...]:
    """Strokes in each plane, then speeds in both, over the joined samples."""
    from ..inference.criticism import Window

    def whole(member: int, samples: NDArray[np.bool_], planes: tuple[int, ...]) -> NDArray:
        there = np.zeros((*stirring.member.shape, len(PLANE_NAMES)), bool)
        rows = np.flatnonzero(stirring.member == member)[samples]
        there[rows[:, None], list(planes)] = True
        return there

    found = []
    for member, recording in enumerate(stirring.recordings):
        for stroke in strokes(recording):
            time = recording.time[stroke.samples]
            label = {
                "recording": recording.path.name,
                "stroke": stroke.number,
                "start_s": float(time[0]),
                "stop_s": float(time[-1]),
            }
            for plane, name in enumerate(PLANE_NAMES):
                samples = whole(member, stroke.samples, (plane,))
                found.append(Window({"channel": name, **label}, samples))
        for text, samples in _speeds(recording):
            label = {"recording": recording.path.name, "speed": text}
            found.append(Window(label, whole(member, samples, (0, 1))))
    return tuple(found)


def _speeds(recording: Recording) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Stretches of like speed after the first rest."""
    fast, rest = speed(recording), resting(recording)
    edges = np.linspace(0.0, fast.max(), SPEEDS + 1)
    bins = np.clip(np.digitize(fast, edges) - 1, 0, SPEEDS - 1)
    for k in range(SPEEDS):
        samples = (bins == k) & ~rest
        if samples.any():
            yield f"{100 * edges[k]:.0f} to {100 * edges[k + 1]:.0f} cm/s", samples
