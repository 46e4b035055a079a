"""A camera that renders what a world shows, in real time."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..csv_file import CsvAppender
from ..process import REAL_CLOCK, HostClock
from ..rendering.drawing import Stage, exposure_times, render
from ..rendering.world import World
from ..vision.frame import Frame
from .base import FrameSource

MAX_LATENESS = 0.2  # s; a camera that is further behind leaves frames out
TRUTH_COLUMNS = ("index", "stamp", "time", "inclination_xz", "inclination_yz")


@dataclass(frozen=True)
class Timing:
    """When a rendered camera takes its frames.

    Attributes:
        rate: Frames per second.
        latency: From the middle of the exposure to the frame's arrival [s].
        seed: Of the noise.
    """

    rate: float = 30.0
    latency: float = 0.03
    seed: int = 0


class RenderedCamera(FrameSource):
    """Shows a world at even times from its start.

    A frame that is asked for late still shows its own moment; frames are left out only when the
    camera is more than `MAX_LATENESS` behind, as a real one drops what nobody fetched.
    """

    def __init__(
        self,
        stage: Stage,
        world: World,
        timing: Timing | None = None,
        *,
        truth: Path | None = None,
        clock: HostClock = REAL_CLOCK,
    ) -> None:
        """Start the camera.

        Args:
            stage: What it looks at, and how.
            world: Where the gripper and the stick are.
            timing: Of the frames; by default that of a webcam at 30 frames per second.
            truth: A CSV file to write what every frame truly showed.
            clock: This computer's.
        """
        self._stage, self._world = stage, world
        self._timing = Timing() if timing is None else timing
        self._clock = clock
        self._start = clock.now()
        self._next = 0
        self._rng = np.random.default_rng(self._timing.seed)
        self._truth = None if truth is None else CsvAppender(truth, TRUTH_COLUMNS)

    def read(self) -> Frame | None:
        index = self._skip_missed()
        exposed = self._exposed(index)
        self._clock.sleep(exposed + self._timing.latency - self._clock.now())
        self._next = index + 1
        stage = self._stage
        moments = exposure_times(exposed, stage.look)
        states = [self._world.state(float(moment)) for moment in moments]
        image = render(stage, states, self._rng)
        stamp = exposed + self._timing.latency
        if self._truth is not None:
            middle = states[len(states) // 2]
            self._truth.append([(index, stamp, middle.time, *middle.inclination)])
        return Frame(index, stamp, image)

    def close(self) -> None:
        if self._truth is not None:
            self._truth.close()

    def _skip_missed(self) -> int:
        """Index of the oldest frame that is not too late."""
        behind = self._clock.now() - self._exposed(self._next) - self._timing.latency
        if behind <= MAX_LATENESS:
            return self._next
        return self._next + int(np.ceil((behind - MAX_LATENESS) * self._timing.rate))

    def _exposed(self, index: int) -> float:
        return self._start + index / self._timing.rate
