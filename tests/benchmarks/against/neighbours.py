"""Whether the simulator tells two liquids apart as the reference does, on one path with one rig."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np
from case import Row
from numpy.typing import NDArray

from bolfi_liquids.inputs.recording import LENGTHS, STICK_WEIGHT

from .stir_replay import CAMERA_NOISE, rms, without_noise
from .stirs import ReferenceStir

MAX_DIFFERENCE = 0.25  # of the ratio from 1
LEAST_JUDGED = 2.0 * CAMERA_NOISE
"""RMS difference in the reference [deg] below which start and noise decide the ratio."""
SAME_PLACE = 1e-4
"""By which the grippers of one path may differ [m]: that of interpolated samples."""

Pair = tuple[ReferenceStir, ReferenceStir]


def judged_pairs(stirs: Iterable[ReferenceStir]) -> list[Pair]:
    """Stirs of a path and rig whose liquids follow each other in viscosity, path by path.

    Pairs that the reference itself does not tell apart are left out.

    Args:
        stirs: All of the reference, from the thinnest liquid to the thickest.
    """
    return [
        (thinner, thicker)
        for group in _same_paths(stirs)
        for thinner, thicker in pairwise(group)
        if thinner.viscosity < thicker.viscosity
        and recorded_difference(thinner, thicker) >= LEAST_JUDGED
    ]


def recorded_difference(thinner: ReferenceStir, thicker: ReferenceStir) -> float:
    """RMS difference between the reference's signals, without noise [deg]."""
    apart = thicker.recording.inclination - thinner.recording.inclination
    return without_noise(rms(np.degrees(apart)), recordings=2)


def ratio_row(
    thinner: ReferenceStir, thicker: ReferenceStir, signals: Sequence[NDArray[np.float64]]
) -> Row:
    """Ratio of the simulated difference to the reference's.

    Args:
        thinner, thicker: A pair.
        signals: Of both [deg], each [B, T, 2]; differences are those between means over seeds.
    """
    first, second = (one.mean(axis=0) for one in signals)
    ratio = rms(second - first) / recorded_difference(thinner, thicker)
    quantity = f"difference over the reference's, {thinner.name} and {thicker.name}"
    return Row.absolute(quantity, 1.0, ratio, MAX_DIFFERENCE)


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
