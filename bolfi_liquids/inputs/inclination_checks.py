"""What no camera can have seen of a stick that hangs in a cup."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .fields import PLANES
from .recording import Recording
from .start import noise_of

MAX_FROZEN_TIME = 1.0
"""Longest time in which an inclination may be the same number while the gripper moves [s]."""
MAX_FROZEN_SHARE = 0.25
"""Largest share of the time in which the gripper moves, likewise."""
MIN_FROZEN_TIME = 0.25
"""Time of equal numbers that is no coincidence of a coarse scale [s]."""
MIN_SPEED_SHARE = 0.2
"""Of the gripper's usual speed, above which it moves."""
MAX_NOISE = np.radians(3.0)
"""Of an inclination [rad], where it is most of what there is."""
MAX_NOISE_SHARE = 0.8
"""Of an inclination's standard deviation."""
MAX_BEYOND_SHARE = 0.02
"""Of samples in which the stick may lean further than the cup lets it: mistakes of a camera."""
RIM_MARGIN = np.radians(10.0)
"""Beyond the angle at which the stick lies on the cup's rim [rad]."""
SPEED_TIME = 0.1
"""Time over which the gripper's speed is taken [s]."""
MIN_FAST = 0.05
"""Speed of the gripper from which every stick leans visibly [m/s]."""
MIN_LEAN = np.radians(0.2)
"""That it leans then, at the least [rad]: the start of a stroke, or a circle of 7 cm, does as much
by inertia alone."""
UPWARD = np.radians([150.0, 210.0])
"""Inclination of a stick that hangs, counted from the upward vertical [rad]."""


def check_inclination_values(recording: Recording) -> None:
    """Raise `InputError` at an inclination that cannot be one."""
    for name, values in zip(PLANES, recording.inclination.T, strict=True):
        where = f"{recording.path}: {name}"
        _check_unit(values, where)
        _check_frozen(recording, values, where)
        _check_noise(values, where)
        _check_rim(recording, values, where)
    _check_small(recording)


def _check_unit(values: NDArray, where: str) -> None:
    size = np.abs(values[~np.isnan(values)])
    if np.isinf(size).any():
        raise InputError("infinite", where=where, fix="mark missing samples by NaN")
    middle, largest = float(np.median(size)), float(size.max())
    if UPWARD[0] < middle < UPWARD[1]:
        raise InputError(
            f"is about {middle:.3g} rad, as if counted from the upward vertical",
            where=where,
            fix="a stick that hangs straight down has 0: take pi from it",
        )
    if largest > np.pi / 2:
        raise InputError(
            f"reaches {largest:g} rad, which looks like degrees",
            where=where,
            fix="convert the inclination to rad",
        )


def _check_small(recording: Recording) -> None:
    """Refuse a stick that stays upright behind a gripper that is fast."""
    known = np.isfinite(recording.gripper.position).all(axis=1)
    time, position = recording.time[known], recording.gripper.position[known]
    apart = np.searchsorted(time, time[0] + SPEED_TIME)  # samples; so far apart noise is no speed
    way = np.linalg.norm(position[apart:] - position[:-apart], axis=1)
    speed = way / (time[apart:] - time[:-apart])
    fast = float(np.quantile(speed, 0.9)) if len(speed) else 0.0
    leans = [np.abs(plane - np.nanmedian(plane)) for plane in recording.inclination.T]
    lean = max(float(np.nanquantile(one, 0.99)) for one in leans)
    if fast < MIN_FAST or lean >= MIN_LEAN:
        return
    raise InputError(
        f"{PLANES[0]} and {PLANES[1]} stay within {np.degrees(lean):.2g} deg while the gripper "
        f"moves at {100.0 * fast:.0f} cm/s, which looks like radians that were taken for degrees",
        where=str(recording.path),
        fix="convert the inclination once only",
    )


def _check_frozen(recording: Recording, values: NDArray, where: str) -> None:
    """Refuse one number again and again while the gripper moves: the picture stood still."""
    time, position = recording.time, recording.gripper.position
    seen = np.isfinite(values) & np.isfinite(position).all(axis=1)
    step = np.diff(time[seen])
    way = np.linalg.norm(np.diff(position[seen], axis=0), axis=1)
    moving = way > MIN_SPEED_SHARE * float(np.quantile(way / step, 0.9)) * step
    same = np.diff(values[seen]) == 0.0
    runs = np.cumsum(~same)[same]  # intervals without change, by what they follow
    _, run = np.unique(runs, return_inverse=True)
    lasts = np.bincount(run, weights=np.where(moving, step, 0.0)[same])
    starts = np.unique(runs, return_index=True)[1]
    longest = float(lasts.max(initial=0.0))
    frozen = float(lasts[lasts > MIN_FROZEN_TIME].sum())
    if longest <= MAX_FROZEN_TIME and frozen <= MAX_FROZEN_SHARE * float(step[moving].sum()):
        return
    at = np.flatnonzero(same)[starts[int(lasts.argmax())]]
    raise InputError(
        f"is {float(values[seen][at]):g} rad for {longest:.2f} s from {time[seen][at]:.2f} s on, "
        f"in all for {frozen:.2f} s, while the gripper moves: the camera stood still",
        where=where,
        fix="record again, or mark those samples by NaN",
    )


def _check_noise(values: NDArray, where: str) -> None:
    noise, spread = noise_of(values), float(np.nanstd(values))
    if noise > MAX_NOISE and noise > MAX_NOISE_SHARE * spread:
        raise InputError(
            f"jumps by {np.degrees(np.sqrt(2.0) * noise):.3g} deg from sample to sample, as no "
            "stick moves",
            where=where,
            fix="look at what the camera measured, and record again",
        )


def _check_rim(recording: Recording, values: NDArray, where: str) -> None:
    """Refuse a stick that leans further than the rim of its cup lets it."""
    above = float(np.nanmin(recording.gripper.position[:, 2])) - recording.number("cup_height")
    if above <= 0.0:
        return
    most = np.arctan2(2.0 * recording.number("cup_radius"), above)
    size = np.abs(values[np.isfinite(values)])
    if (size > most + RIM_MARGIN).mean() <= MAX_BEYOND_SHARE:
        return
    raise InputError(
        f"reaches {size.max():g} rad, which looks like degrees: the cup's rim stops the stick at "
        f"{most:.2g} rad",
        where=where,
        fix="convert the inclination to rad, or measure cup_radius, cup_height and z again",
    )
