"""Whether the simulator tells two liquids apart as the reference does, on one path with one rig."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inputs.fields import LENGTHS, STICK_WEIGHT
from .physics_records import plain
from .reference_stirs import ReferenceStir
from .replay import CAMERA_NOISE, rms, without_noise

MAX_DIFFERENCE = 0.25  # of the ratio from 1
LEAST_JUDGED = 2.0 * CAMERA_NOISE
"""RMS difference in the reference [deg] below which start and noise decide the ratio."""
SAME_PLACE = 1e-4
"""By which the grippers of one path may differ [m]: that of interpolated samples."""


class Neighbours(NamedTuple):
    """Two recordings of a path and rig whose liquids follow each other in viscosity.

    Attributes:
        thinner, thicker: Names.
        viscosity: Of both [Pa s].
        reference: RMS difference between the reference's signals, without noise [deg].
        simulated: The same between the simulated ones, each the mean over seeds [deg].
    """

    thinner: str
    thicker: str
    viscosity: tuple[float, float]
    reference: float
    simulated: float

    @property
    def judged(self) -> bool:
        """Whether the reference itself tells them apart."""
        return self.reference >= LEAST_JUDGED

    @property
    def ratio(self) -> float | None:
        """Of the simulated difference to the reference's; None where that is not judged."""
        return self.simulated / self.reference if self.judged else None

    @property
    def passed(self) -> bool:
        """The ratio is within its bar, or not judged."""
        return self.ratio is None or abs(self.ratio - 1.0) <= MAX_DIFFERENCE

    def to_json(self) -> dict[str, Any]:
        """As plain numbers and text; None for a simulation that failed."""
        judged = {"ratio": self.ratio, "judged": self.judged, "passed": self.passed}
        return plain({**self._asdict(), **judged})


def neighbours(
    stirs: Iterable[ReferenceStir], records: Mapping[str, Mapping[str, Any]]
) -> tuple[Neighbours, ...]:
    """Pairs that were simulated, path by path.

    Args:
        stirs: All of the reference, from the thinnest liquid to the thickest.
        records: By name; a pair without a record of both, or of one that raised, is left out.
    """
    done = {name for name, record in records.items() if record["panels"]}
    return tuple(
        _compared(thinner, thicker, records)
        for group in _same_paths(stirs)
        for thinner, thicker in pairwise(group)
        if thinner.viscosity < thicker.viscosity and {thinner.name, thicker.name} <= done
    )


def _same_paths(stirs: Iterable[ReferenceStir]) -> Iterator[Sequence[ReferenceStir]]:
    """Stirs without a hidden effect in groups of one path and rig, in their order."""
    groups: list[list[ReferenceStir]] = []
    for stir in (stir for stir in stirs if not stir.effects):
        group = next((one for one in groups if _alike(one[0], stir)), None)
        if group is None:
            groups.append([stir])
        else:
            group.append(stir)
    return iter(groups)


def _alike(one: ReferenceStir, other: ReferenceStir) -> bool:
    """Whether gripper, cup and stick are the same as they are written down."""
    first, second = one.recording, other.recording
    rigs = [
        {name: stir.attrs.get(name) for name in (*LENGTHS, *STICK_WEIGHT)}
        for stir in (first, second)
    ]
    if rigs[0] != rigs[1] or len(first.time) != len(second.time):
        return False
    times = np.abs((first.time - first.time[0]) - (second.time - second.time[0]))
    apart = np.abs(first.gripper.position - second.gripper.position)
    return bool(times.max() < 1e-3 and np.nanmax(apart) < SAME_PLACE)


def _compared(
    thinner: ReferenceStir, thicker: ReferenceStir, records: Mapping[str, Mapping[str, Any]]
) -> Neighbours:
    recorded = thicker.recording.inclination - thinner.recording.inclination
    means = [_mean_simulated(records[stir.name]) for stir in (thinner, thicker)]
    return Neighbours(
        thinner.name,
        thicker.name,
        (thinner.viscosity, thicker.viscosity),
        without_noise(rms(np.degrees(recorded)), recordings=2),
        rms(means[1] - means[0]),
    )


def _mean_simulated(record: Mapping[str, Any]) -> NDArray[np.float64]:
    """Inclination [deg] of a record's plot, shape [T, 2], the mean over seeds."""
    planes = [
        np.array([curve["y"] for curve in panel["curves"] if not curve["truth"]], float)
        for panel in record["panels"]
    ]
    return np.stack([trials.mean(axis=0) for trials in planes], axis=1)
