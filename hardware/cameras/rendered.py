"""A camera that renders what a world shows, in real time and with a clock of its own."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from ..host_clock import REAL_CLOCK, HostClock
from ..rendering.drawing import Stage, exposure_times, render
from ..rendering.faults import fault_of
from ..rendering.world import World, WorldState
from ..vision.frame import Frame

MAX_LATENESS = 0.2  # s; a camera that is further behind leaves frames out
TRUTH_COLUMNS = ("index", "stamp", "time", "inclination_xz", "inclination_yz")


@dataclass(frozen=True)
class Timing:
    """When a rendered camera takes its frames.

    Attributes:
        rate: Frames per second of its own clock.
        latency: From the middle of the exposure to the frame's arrival [s].
        offset: Camera's clock minus this computer's, when the camera starts [s].
        drift: Camera's clock runs so much faster than this computer's; 1e-5 is usual.
        seed: Of noise and faults.
    """

    rate: float = 30.0
    latency: float = 0.03
    offset: float = 1000.0
    drift: float = 2e-5
    seed: int = 0


class RenderedCamera:
    """Shows a world at absolute times of its own clock.

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
        """Start the camera's clock.

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
        self._file: IO[str] | None = None if truth is None else truth.open("w", newline="")
        if self._file is not None:
            csv.writer(self._file).writerow(TRUTH_COLUMNS)

    def read(self) -> Frame | None:
        """The next frame; waits until it would have arrived."""
        index = self._skip_missed()
        exposed = self._exposed(index)
        self._clock.sleep(exposed + self._timing.latency - self._clock.now())
        self._next = index + 1
        stage = self._stage
        moments = exposure_times(exposed, stage.look)
        states = [self._world.state(float(moment)) for moment in moments]
        fault = fault_of(index, stage.look.faults, stage.area, self._timing.seed)
        image = render(stage, states, self._rng, fault)
        stamp = self._stamp(exposed)
        self._write_truth(index, stamp, states[len(states) // 2])
        return Frame(index, stamp, max(self._clock.now(), exposed + self._timing.latency), image)

    def close(self) -> None:
        """Close the file of truths."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _skip_missed(self) -> int:
        """Index of the oldest frame that is not too late."""
        behind = self._clock.now() - self._exposed(self._next) - self._timing.latency
        if behind <= MAX_LATENESS:
            return self._next
        return self._next + int(np.ceil((behind - MAX_LATENESS) * self._rate))

    @property
    def _rate(self) -> float:
        """Frames per second of this computer's clock."""
        return self._timing.rate * (1.0 + self._timing.drift)

    def _exposed(self, index: int) -> float:
        return self._start + index / self._rate

    def _stamp(self, host: float) -> float:
        ahead = (host - self._start) * self._timing.drift
        return host + self._timing.offset + ahead

    def _write_truth(self, index: int, stamp: float, state: WorldState) -> None:
        if self._file is None:
            return
        row = (index, repr(stamp), repr(state.time), *(repr(float(a)) for a in state.inclination))
        csv.writer(self._file).writerow(row)
        self._file.flush()
