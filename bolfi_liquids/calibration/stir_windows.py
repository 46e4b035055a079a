"""Windows of a stir: its strokes in each plane, and stretches of like speed."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..inputs.fields import PLANE_NAMES
from ..inputs.recording import Recording
from ..inputs.strokes import resting, speed, strokes
from ..simulators import StirSimulator

if TYPE_CHECKING:
    from ..inference.criticism import Window

SPEED_BINS = 3


def windows(stirring: StirSimulator) -> tuple["Window", ...]:
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
    edges = np.linspace(0.0, fast.max(), SPEED_BINS + 1)
    bins = np.clip(np.digitize(fast, edges) - 1, 0, SPEED_BINS - 1)
    for k in range(SPEED_BINS):
        samples = (bins == k) & ~rest
        if samples.any():
            yield f"{100 * edges[k]:.0f} to {100 * edges[k + 1]:.0f} cm/s", samples
