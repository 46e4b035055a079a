"""Places of simulations among the lanes of groups that march at the same time."""

import math
import os
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..faults import ABSENT
from ..runtime import THREADS

GROWTH = 1.5  # of the room from one scene to the next


def processors() -> int:
    """Number of processors that this process may use: at most as many as Taichi's threads."""
    there = os.cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        there = len(os.sched_getaffinity(0))
    return max(1, min(there, int(os.environ.get(THREADS, there))))


GROUPS = processors()  # that march at the same time, each on its own processor


def room_for(needed: float, least: int) -> int:
    """Room that scenes of about this size share, so that one is compiled for all."""
    doublings = max(0, math.ceil(math.log(needed / least, GROWTH) - 1e-9))
    return math.ceil(least * GROWTH**doublings)


@dataclass(frozen=True)
class Places:
    """The lanes and groups of `size` simulations.

    Groups share them evenly, so that few keep all processors busy. Neighbours march together.

    Attributes:
        size: At most `groups` times `lanes`.
        most_groups: That may be used.
        lanes: Of a group.
    """

    size: int
    most_groups: int
    lanes: int

    @cached_property
    def slots(self) -> np.ndarray:
        """Lanes, counted through all groups, shape (size,)."""
        each = math.ceil(self.size / min(self.most_groups, self.size))
        number = np.arange(self.size)
        return number // each * self.lanes + number % each

    @property
    def groups(self) -> int:
        """Number of groups in use."""
        return int(self.slots[-1]) // self.lanes + 1

    def spread(self, values: np.ndarray) -> np.ndarray:
        """(size, ...) as float32 (groups, lanes, ...); lanes without a simulation hold ones."""
        full = np.ones((self.groups * self.lanes, *np.shape(values)[1:]), np.float32)
        full[self.slots] = values
        return full.reshape(self.groups, self.lanes, *full.shape[1:])

    def gather(self, values: np.ndarray) -> np.ndarray:
        """(groups, lanes, ...), of all groups that there are, as (size, ...)."""
        return values.reshape(-1, *values.shape[2:])[self.slots]

    def spread_points(self, points: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """One (n, 3) for each simulation as float32 (groups, lanes, most n, 3), and each lane's n,
        int32 (groups, lanes); ABSENT where there is no simulation."""
        counts = np.full(self.groups * self.lanes, ABSENT, np.int32)
        counts[self.slots] = [len(one) for one in points]
        positions = np.zeros((len(counts), max(counts.max(), 1), 3), np.float32)
        for slot, one in zip(self.slots, points, strict=True):
            positions[slot, : len(one)] = one
        shape = self.groups, self.lanes
        return positions.reshape(*shape, -1, 3), counts.reshape(shape)
