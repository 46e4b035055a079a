"""What a recording's values must satisfy for a simulator to replay it."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .fields import AXES, DENSITIES, LENGTHS, PLANES, STICK_WEIGHT
from .inclination_checks import check_inclination_values
from .recording import Recording
from .start import above_liquid

MIN_SAMPLES = 10
MAX_GRIPPER_GAP = 0.2
"""Longest gap in the gripper's path that is interpolated [s]: less than half a stroke."""
MAX_UNSEEN_TIME = 0.5
"""Longest time that the stick may be out of sight [s]: a longer one hides most of a stroke."""
MIN_SEEN = 0.5
"""Smallest share of a plane's samples in which the stick must have been seen."""
MAX_INTERVAL = 1.0  # between samples [s]; more looks like milliseconds
MAX_POSITION = 2.0  # of the gripper [m]; more looks like cm or mm
SIZE_LIMITS = {
    "cup_radius": (5e-3, 0.25),
    "cup_height": (5e-3, 0.5),
    "fill": (1e-3, 0.5),
    "stick_radius": (2e-4, 0.05),
    "stick_length": (0.02, 1.0),
}
"""Of cups and sticks that are stirred by hand or arm [m]; more looks like cm or mm."""
MAX_MASS = 2.0  # of the stick [kg]; more looks like grams
MAX_STICK_DENSITY = 25_000.0  # [kg/m3]; no stick is denser
MAX_SPEED = 1.0  # of the gripper [m/s]; more looks like a time in other units
MIN_TRAVEL = 1e-3  # of the gripper [m]; a liquid that is not stirred shows nothing
MIN_DENSITY, MAX_DENSITY = 50.0, 20_000.0  # [kg/m3]; less looks like g/cm3


def check_values(recording: Recording) -> None:
    """Raise `InputError` at the first value that no simulator could use."""
    _check_time(recording)
    _check_numbers(recording)
    _check_sizes(recording)
    _check_gripper(recording)
    _check_inclination(recording)
    _check_scene(recording)


def _check_time(recording: Recording) -> None:
    time, where = recording.time, f"{recording.path}: time"
    if len(time) < MIN_SAMPLES:
        raise InputError(
            f"{len(time)} samples", where=where, fix=f"record at least {MIN_SAMPLES} samples"
        )
    if not np.isfinite(time).all():
        at = int(np.flatnonzero(~np.isfinite(time))[0])
        raise InputError(f"time[{at}] = {time[at]}", where=where, fix="every sample needs a time")
    step = np.diff(time)
    if (step <= 0).any():
        at = int(np.flatnonzero(step <= 0)[0]) + 1
        raise InputError(
            f"time[{at}] = {time[at]:g} s does not follow time[{at - 1}] = {time[at - 1]:g} s",
            where=where,
            fix="times must increase: sort the samples and drop repeated ones",
        )
    if np.median(step) > MAX_INTERVAL:
        raise InputError(
            f"samples are {np.median(step):g} s apart, which looks like milliseconds",
            where=where,
            fix="convert the times to s",
        )


def _check_numbers(recording: Recording) -> None:
    names = LENGTHS + DENSITIES + tuple(n for n in STICK_WEIGHT if n in recording.attrs)
    for name in names:
        value = recording.attrs[name]
        if (
            not isinstance(value, int | float)
            or isinstance(value, bool)
            or not np.isfinite(value)
            or value <= 0
        ):
            raise InputError(
                f"{' '.join(repr(value).split()):.80}",
                where=f"{recording.path}: attribute {name}",
                fix="it must be a positive number, in SI units",
            )


def _check_sizes(recording: Recording) -> None:
    attrs = recording.attrs
    for name in LENGTHS:
        least, most = SIZE_LIMITS[name]
        if recording.number(name) > most:
            raise InputError(
                f"{attrs[name]} m looks like cm or mm: it may be {most:g} m at the most",
                where=f"{recording.path}: attribute {name}",
                fix="convert it to m",
            )
        if recording.number(name) < least:
            raise InputError(
                f"{attrs[name]} m is too small: it must be {least:g} m at least",
                where=f"{recording.path}: attribute {name}",
                fix="measure it again, in m",
            )
    if "stick_mass" in attrs and recording.number("stick_mass") > MAX_MASS:
        raise InputError(
            f"{attrs['stick_mass']} kg looks like grams",
            where=f"{recording.path}: attribute stick_mass",
            fix="convert it to kg",
        )
    if "stick_mass" in attrs:
        volume = np.pi * recording.number("stick_radius") ** 2 * recording.number("stick_length")
        if (density := recording.number("stick_mass") / volume) > MAX_STICK_DENSITY:
            raise InputError(
                f"{attrs['stick_mass']} kg looks like grams: it makes {density:.3g} kg/m3",
                where=f"{recording.path}: attribute stick_mass",
                fix="convert it to kg, or measure the stick again",
            )
    for name in (*DENSITIES, "stick_density"):
        if name in attrs and not MIN_DENSITY <= recording.number(name) <= MAX_DENSITY:
            raise InputError(
                f"{attrs[name]} kg/m3 is no liquid's or stick's density",
                where=f"{recording.path}: attribute {name}",
                fix="give it in kg/m3 (water: 1000)",
            )
    for inner, outer in (("fill", "cup_height"), ("stick_radius", "cup_radius")):
        if recording.number(inner) >= recording.number(outer):
            raise InputError(
                f"{attrs[inner]} m is not below {outer} = {attrs[outer]} m",
                where=f"{recording.path}: attribute {inner}",
                fix="measure both again, in m",
            )


def _check_gripper(recording: Recording) -> None:
    for name, values in zip(AXES, recording.gripper.position.T, strict=True):
        where = f"{recording.path}: {name}"
        seen = ~np.isnan(values)
        if np.abs(values[seen]).max(initial=0.0) > MAX_POSITION:
            raise InputError(
                f"reaches {np.abs(values[seen]).max():g} m, which looks like cm or mm",
                where=where,
                fix="convert the positions to m",
            )
        gap, start = longest_gap(recording.time, seen)
        if gap > MAX_GRIPPER_GAP:
            raise InputError(
                f"no gripper position for {gap:.2f} s from {start:.2f} s on",
                where=where,
                fix=f"gaps up to {MAX_GRIPPER_GAP} s can be filled: cut the recording before it",
            )
    seen = np.isfinite(recording.gripper.position).all(axis=1)
    way, time = recording.gripper.position[seen], recording.time[seen]
    usual = np.median(np.linalg.norm(np.diff(way, axis=0), axis=1) / np.diff(time))
    if usual > MAX_SPEED:
        raise InputError(
            f"the gripper moves at {usual:.3g} m/s, faster than any arm stirs",
            where=f"{recording.path}: time",
            fix="give times in s and positions in m",
        )


def longest_gap(time: NDArray, seen: NDArray[np.bool_]) -> tuple[float, float]:
    """Longest time without a sample, and when it starts.

    Args:
        time: Times of the samples [s], shape (T,).
        seen: Which of them hold a value, shape (T,).

    Returns:
        Duration and start [s]. A gap at an end lasts from the first or to the last sample.
    """
    edges = np.unique(np.concatenate([time[:1], time[seen], time[-1:]]))
    gaps = np.diff(edges)
    at = int(gaps.argmax())
    return float(gaps[at]), float(edges[at])


def _check_inclination(recording: Recording) -> None:
    for name, values in zip(PLANES, recording.inclination.T, strict=True):
        where = f"{recording.path}: {name}"
        seen = ~np.isnan(values)
        if seen.mean() < MIN_SEEN:
            raise InputError(
                f"NaN in {len(seen) - seen.sum()} of {len(seen)} samples",
                where=where,
                fix=f"the stick must be seen in at least {MIN_SEEN:.0%} of them: record again",
            )
        gap, start = longest_gap(recording.time, seen)
        if gap > MAX_UNSEEN_TIME:
            raise InputError(
                f"NaN for {gap:.2f} s from {start:.2f} s on",
                where=where,
                fix=f"gaps up to {MAX_UNSEEN_TIME} s can be skipped: cut the recording before it",
            )
    check_inclination_values(recording)


def check_hangs(recording: Recording) -> None:
    """Buoyancy's moment about the pivot must stay below the weight's, or the stick floats up.

    Raises:
        InputError: It floats.
    """
    from ..models import StirSetup

    if above_liquid(recording) >= 0.0:
        return  # nothing lifts it there, and `check_start` refuses it
    setup = StirSetup.from_recording(recording)
    stick, wet, mass = setup.stick, setup.submerged, setup.stick.mass
    displaced = recording.number("liquid_density") * np.pi * stick.radius**2 * wet
    lifted = displaced * (stick.length - wet / 2)
    if lifted >= mass * stick.length / 2:
        raise InputError(
            f"a stick of {1000 * mass:.3g} g floats up in this liquid",
            where=f"{recording.path}: attribute {' or '.join(STICK_WEIGHT)}",
            fix="weigh the stick again; it must hang",
        )


def _check_scene(recording: Recording) -> None:
    cup, fill = recording.number("cup_radius"), recording.number("fill")
    x, y, z = recording.gripper.position.T
    radius = float(np.nanmax(np.hypot(x, y)))
    if radius + recording.number("stick_radius") > cup:
        raise InputError(
            f"the gripper goes {radius:g} m from the cup's axis and leaves the cup"
            f" (cup_radius = {cup:g} m)",
            where=f"{recording.path}: x, y",
            fix="the origin must lie on the cup's axis: shift x and y, or correct cup_radius",
        )
    if max(np.ptp(values[np.isfinite(values)]) for values in (x, y)) < MIN_TRAVEL:
        raise InputError(
            f"the gripper moves less than {MIN_TRAVEL:g} m",
            where=f"{recording.path}: x, y",
            fix="record a stir, or convert the positions to m",
        )
    tip = z - recording.number("stick_length")
    if np.nanmin(tip) >= fill:
        raise InputError(
            f"the stick does not reach the liquid: its tip stays {np.nanmin(tip):g} m above the"
            f" floor, the liquid is {fill:g} m deep",
            where=f"{recording.path}: z, stick_length, fill",
            fix="z counts from the cup's floor: correct z, stick_length or fill",
        )
    if np.nanmin(tip) < 0:
        raise InputError(
            f"the stick goes through the floor: its tip comes to {np.nanmin(tip):g} m",
            where=f"{recording.path}: z, stick_length",
            fix="z counts from the cup's floor: correct z or stick_length",
        )
