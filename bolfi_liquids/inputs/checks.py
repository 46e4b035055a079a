"""What a recording's values must satisfy for a simulator to replay it: one table of rules.

Limits are those of sticks and cups that are stirred by hand or arm. A value in another unit than
that of the file lies outside of them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .fields import AXES, PLANES, STICK_WEIGHT
from .recording import JUMPS, Recording, torn_values
from .start import above_liquid, noise_of

LIMITS = {
    "cup_radius": (5e-3, 0.25, "m"),
    "cup_height": (5e-3, 0.5, "m"),
    "fill": (1e-3, 0.5, "m"),
    "stick_radius": (2e-4, 0.05, "m"),
    "stick_length": (0.02, 1.0, "m"),
    "liquid_density": (50.0, 20_000.0, "kg/m3"),
    "stick_density": (50.0, 20_000.0, "kg/m3"),
    "stick_mass": (0.0, 2.0, "kg"),
}
"""Smallest and largest value of each attribute, and its unit."""

MAX_GRIPPER_GAP = 0.2
"""Longest gap in the gripper's path that is interpolated [s]: less than half a stroke."""
MAX_UNSEEN_TIME = 0.5
"""Longest time that the stick may be out of sight [s]: a longer one hides most of a stroke."""
MIN_SEEN = 0.5
"""Smallest share of a plane's samples in which the stick must have been seen."""
MIN_FROZEN_TIME = 0.25
"""Time of equal numbers that is no coincidence of a coarse scale [s]."""
MIN_SPEED_SHARE = 0.2
"""Of the gripper's usual speed, above which it moves."""
MAX_NOISE_SHARE = 0.8
"""Of an inclination's standard deviation, up to which noise is not judged."""
RIM_MARGIN = np.radians(10.0)
"""Beyond the angle at which the stick lies on the cup's rim [rad]."""
SPEED_TIME = 0.1
"""Time over which the gripper's speed is taken [s]."""
MIN_FAST = 0.05
"""Speed of the gripper from which every stick leans visibly [m/s]."""

Measured = tuple[float, str]
"""A value, and where or how it came about; the text begins with a blank or is empty."""


@dataclass(frozen=True)
class Rule:
    """A quantity of a recording, its limits, and what to do beyond them.

    Attributes:
        field: Of the file.
        quantity: Its name.
        measure: Its value in a recording; NaN lies outside of all limits.
        fix: The remedy.
        least: The smallest value allowed.
        most: The largest value allowed.
        unit: Of value and limits.
    """

    field: str
    quantity: str
    measure: Callable[[Recording], Measured]
    fix: str
    least: float = -np.inf
    most: float = np.inf
    unit: str = ""

    def check(self, recording: Recording) -> None:
        """Raise `InputError` outside of the limits."""
        value, note = self.measure(recording)
        if self.least <= value <= self.most:
            return
        ends = [("at least", self.least), ("at most", self.most)]
        limits = [f"{word} {end:g} {self.unit}".strip() for word, end in ends if np.isfinite(end)]
        raise InputError(
            f"{self.quantity} = {value:.6g} {self.unit}".strip()
            + f"{note}, {' and '.join(limits)} allowed",
            where=f"{recording.path}: {self.field}",
            fix=self.fix,
        )


def check_values(recording: Recording) -> None:
    """Raise `InputError` at the first value that no simulator could use."""
    for rule in TIME:
        rule.check(recording)
    for name in LIMITS:
        if name not in STICK_WEIGHT or name in recording.attrs:
            _check_attribute(recording, name)
    for rule in (*SIZES, *GRIPPER, *INCLINATION, *SCENE):
        rule.check(recording)


def _check_attribute(recording: Recording, name: str) -> None:
    value, (least, most, unit) = recording.attrs[name], LIMITS[name]
    where = f"{recording.path}: attribute {name}"
    if not isinstance(value, int | float) or isinstance(value, bool) or not value > 0.0:
        raise InputError(
            f"{' '.join(repr(value).split()):.80}",
            where=where,
            fix=f"it must be a positive number [{unit}]",
        )
    if not least <= value <= most:
        raise InputError(
            f"{value:g} {unit}, at least {least:g} {unit} and at most {most:g} {unit} allowed",
            where=where,
            fix=f"give it in {unit}, or measure it again",
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


def _samples(recording: Recording) -> Measured:
    return len(recording.time), ""


def _untimed(recording: Recording) -> Measured:
    missing = ~np.isfinite(recording.time)
    return int(missing.sum()), f", the first is sample {int(missing.argmax())}"


def _repeated(recording: Recording) -> Measured:
    stamps, counts = np.unique(recording.time, return_counts=True)
    count, distinct = len(recording.time), len(stamps)
    decimals = next((n for n in range(9) if np.array_equal(stamps.round(n), stamps)), 9)
    first = f"{stamps[counts.argmax()]:.13g} s"
    return count - distinct, (
        f" ({count} stamps, {distinct} distinct, of {decimals} decimals; such as {first})"
    )


def _shortest_step(recording: Recording) -> Measured:
    step = np.diff(recording.time)
    at = int(step.argmin())
    before, after = recording.time[at : at + 2]
    return float(step[at]), f" from time[{at}] = {before:.13g} s to time[{at + 1}] = {after:.13g} s"


def _usual_step(recording: Recording) -> Measured:
    return float(np.median(np.diff(recording.time))), ""


def _apart(recording: Recording) -> Measured:
    """Time between two logs of which one ends before the other begins."""
    position = np.isfinite(recording.gripper.position).any(axis=1)
    seen = np.isfinite(recording.inclination).any(axis=1)
    if not position.any() or not seen.any():
        return 0.0, ""
    arm, camera = recording.time[position], recording.time[seen]
    disjoint = arm[-1] < camera[0] or camera[-1] < arm[0]
    return float(abs(camera[0] - arm[0])) if disjoint else 0.0, ""


def _ratio(inner: str, outer: str, recording: Recording) -> Measured:
    part, whole = recording.number(inner), recording.number(outer)
    return part / whole, f" ({part:g} m of {whole:g} m)"


def _made_density(recording: Recording) -> Measured:
    if "stick_mass" not in recording.attrs:
        return 0.0, ""
    volume = np.pi * recording.number("stick_radius") ** 2 * recording.number("stick_length")
    mass = recording.number("stick_mass")
    return mass / volume, f" (of {mass:g} kg)"


def _torn(recording: Recording) -> Measured:
    """Samples that jump out and back; a few of them are missing already."""
    columns = (*recording.gripper.position.T, *recording.inclination.T)
    each = [torn_values(one, jump) for one, jump in zip(columns, JUMPS.values(), strict=True)]
    torn = np.any(each, axis=0)
    first = int(torn.argmax())
    return int(torn.sum()), (
        f" of {len(torn)}, the first is sample {first} at {recording.time[first]:.10g} s"
    )


def _largest(values: NDArray) -> Measured:
    return float(np.abs(values[~np.isnan(values)]).max(initial=0.0)), ""


def _position(axis: int, recording: Recording) -> Measured:
    return _largest(recording.gripper.position[:, axis])


def _gap(values: NDArray, time: NDArray) -> Measured:
    duration, start = longest_gap(time, ~np.isnan(values))
    return duration, f" from {start:.2f} s on"


def _position_gap(axis: int, recording: Recording) -> Measured:
    return _gap(recording.gripper.position[:, axis], recording.time)


def _speed(recording: Recording) -> Measured:
    seen = np.isfinite(recording.gripper.position).all(axis=1)
    way, time = recording.gripper.position[seen], recording.time[seen]
    return float(np.median(np.linalg.norm(np.diff(way, axis=0), axis=1) / np.diff(time))), ""


def _seen(plane: int, recording: Recording) -> Measured:
    missing = np.isnan(recording.inclination[:, plane])
    return 1.0 - missing.mean(), f" (NaN in {missing.sum()} of {len(missing)})"


def _unseen_time(plane: int, recording: Recording) -> Measured:
    return _gap(recording.inclination[:, plane], recording.time)


def _angle(plane: int, recording: Recording) -> Measured:
    return _largest(recording.inclination[:, plane])


def _frozen(plane: int, recording: Recording) -> tuple[float, float, str]:
    """Time of one and the same number while the gripper moves: longest [s], and share of all."""
    values, time, position = recording.inclination[:, plane], *recording.gripper
    seen = np.isfinite(values) & np.isfinite(position).all(axis=1)
    step = np.diff(time[seen])
    way = np.linalg.norm(np.diff(position[seen], axis=0), axis=1)
    moving = way > MIN_SPEED_SHARE * float(np.quantile(way / step, 0.9)) * step
    same = np.diff(values[seen]) == 0.0
    if not same.any():
        return 0.0, 0.0, ""
    runs = np.cumsum(~same)[same]  # intervals without change, by what they follow
    _, starts, run = np.unique(runs, return_index=True, return_inverse=True)
    lasts = np.bincount(run, weights=np.where(moving, step, 0.0)[same])
    at = np.flatnonzero(same)[starts[int(lasts.argmax())]]
    note = f" at {float(values[seen][at]):g} rad from {time[seen][at]:.2f} s on"
    moved = float(step[moving].sum())
    share = float(lasts[lasts > MIN_FROZEN_TIME].sum()) / moved if moved else 0.0
    return float(lasts.max()), share, note


def _frozen_time(plane: int, recording: Recording) -> Measured:
    longest, _, note = _frozen(plane, recording)
    return longest, note


def _frozen_share(plane: int, recording: Recording) -> Measured:
    _, share, note = _frozen(plane, recording)
    return share, note


def _noise(plane: int, recording: Recording) -> Measured:
    values = recording.inclination[:, plane]
    noise = noise_of(values)
    return np.degrees(noise) if noise > MAX_NOISE_SHARE * np.nanstd(values) else 0.0, ""


def _beyond_rim(plane: int, recording: Recording) -> Measured:
    """Share of samples in which the stick leans further than the rim of its cup lets it."""
    above = float(np.nanmin(recording.gripper.position[:, 2])) - recording.number("cup_height")
    if above <= 0.0:
        return 0.0, ""
    most = np.arctan2(2.0 * recording.number("cup_radius"), above)
    values = recording.inclination[:, plane]
    size = np.abs(values[np.isfinite(values)])
    note = f" (up to {size.max():.3g} rad, where the rim stops the stick at {most:.2g} rad)"
    return float((size > most + RIM_MARGIN).mean()), note


def _lean(recording: Recording) -> Measured:
    """How far the stick leans [deg] behind a gripper that is fast."""
    known = np.isfinite(recording.gripper.position).all(axis=1)
    time, position = recording.time[known], recording.gripper.position[known]
    apart = np.searchsorted(time, time[0] + SPEED_TIME)  # samples; so far apart noise is no speed
    way = np.linalg.norm(position[apart:] - position[:-apart], axis=1)
    speed = way / (time[apart:] - time[:-apart])
    fast = float(np.quantile(speed, 0.9)) if len(speed) else 0.0
    leans = [np.abs(plane - np.nanmedian(plane)) for plane in recording.inclination.T]
    lean = max(float(np.degrees(np.nanquantile(one, 0.99))) for one in leans)
    return np.inf if fast < MIN_FAST else lean, f" while the gripper moves at {fast:.2g} m/s"


def _room(recording: Recording) -> Measured:
    """Between the stick at its pivot and the wall of the cup."""
    x, y, _ = recording.gripper.position.T
    radius, cup = float(np.nanmax(np.hypot(x, y))), recording.number("cup_radius")
    note = f" (the gripper goes {radius:g} m from the axis, cup_radius is {cup:g} m)"
    return cup - recording.number("stick_radius") - radius, note


def _travel(recording: Recording) -> Measured:
    x, y, _ = recording.gripper.position.T
    return float(max(np.ptp(values[np.isfinite(values)]) for values in (x, y))), ""


def _lowest_tip(recording: Recording) -> Measured:
    tip = recording.gripper.position[:, 2] - recording.number("stick_length")
    return float(np.nanmin(tip)), " above the cup's floor"


def _depth(recording: Recording) -> Measured:
    """Of the tip in the liquid, at its lowest."""
    tip, _ = _lowest_tip(recording)
    fill = recording.number("fill")
    return fill - tip, f" (the tip is {tip:g} m above the floor, the liquid is {fill:g} m deep)"


def _buoyancy(recording: Recording) -> Measured:
    """Moment of buoyancy about the pivot over that of the weight."""
    from ..models import StirSetup

    if above_liquid(recording) >= 0.0:
        return 0.0, ""  # nothing lifts it there, and `check_start` refuses it
    setup = StirSetup.from_recording(recording)
    stick, wet, mass = setup.stick, setup.submerged, setup.stick.mass
    displaced = recording.number("liquid_density") * np.pi * stick.radius**2 * wet
    lifted = displaced * (stick.length - wet / 2)
    return lifted / (mass * stick.length / 2), f" (a stick of {1000 * mass:.3g} g floats up)"


def _for_each(names: tuple[str, ...], *rules: Callable[[int, str], Rule]) -> tuple[Rule, ...]:
    return tuple(rule(at, name) for at, name in enumerate(names) for rule in rules)


BELOW = np.nextafter(1.0, 0.0)
"""The largest ratio of two things of which the first is smaller."""

TIME = (
    Rule("time", "number of samples", _samples, "record more", least=10),
    Rule("time", "samples without a time", _untimed, "give every sample a time", most=0),
    Rule(
        "time",
        "repeated stamps",
        _repeated,
        "write times with more decimals, or import a table with `rate_hz` in its map",
        most=0,
    ),
    Rule("time", "shortest step", _shortest_step, "sort the samples by time", 1e-9, unit="s"),
    Rule("time", "usual step", _usual_step, "give times in s", most=1.0, unit="s"),
)
SIZES = (
    Rule(
        "attribute stick_mass",
        "density of the stick",
        _made_density,
        "give the mass in kg, or measure the stick again",
        most=25_000.0,
        unit="kg/m3",
    ),
    Rule(
        "attribute fill",
        "fill / cup_height",
        partial(_ratio, "fill", "cup_height"),
        "measure both again, in m",
        most=BELOW,
    ),
    Rule(
        "attribute stick_radius",
        "stick_radius / cup_radius",
        partial(_ratio, "stick_radius", "cup_radius"),
        "measure both again, in m",
        most=BELOW,
    ),
)
GRIPPER = (
    Rule(
        "time",
        "clocks of x, y, z and of the inclination differ by",
        _apart,
        "shift the stamps of one log onto the other's clock",
        most=0.0,
        unit="s",
    ),
    *_for_each(
        AXES,
        lambda axis, name: Rule(
            name,
            "largest position",
            partial(_position, axis),
            "give positions in m from the centre of the cup's floor",
            most=2.0,
            unit="m",
        ),
        lambda axis, name: Rule(
            name,
            "longest time without a position",
            partial(_position_gap, axis),
            "cut the recording before it",
            most=MAX_GRIPPER_GAP,
            unit="s",
        ),
    ),
    Rule(
        "time",
        "usual speed of the gripper",
        _speed,
        "give times in s and positions in m",
        most=1.0,
        unit="m/s",
    ),
)
INCLINATION = (
    *_for_each(
        PLANES,
        lambda plane, name: Rule(
            name,
            "share of samples in which the stick is seen",
            partial(_seen, plane),
            "record again",
            least=MIN_SEEN,
        ),
        lambda plane, name: Rule(
            name,
            "longest time without an inclination",
            partial(_unseen_time, plane),
            "cut the recording before it",
            most=MAX_UNSEEN_TIME,
            unit="s",
        ),
        lambda plane, name: Rule(
            name,
            "largest inclination",
            partial(_angle, plane),
            "give it in rad from the downward vertical, and NaN where the stick was not seen",
            most=np.pi / 2,
            unit="rad",
        ),
    ),
    Rule(
        ", ".join((*AXES, *PLANES)),
        "samples that jump out and back",
        _torn,
        "look at what was measured, and record again; one in a hundred counts as missing",
        most=0,
    ),
    *_for_each(
        PLANES,
        lambda plane, name: Rule(
            name,
            "longest time of one number while the gripper moves",
            partial(_frozen_time, plane),
            "mark samples of a camera that stood still by NaN, or record again",
            most=1.0,
            unit="s",
        ),
        lambda plane, name: Rule(
            name,
            "share of time of one number while the gripper moves",
            partial(_frozen_share, plane),
            "mark samples of a camera that stood still by NaN, or record again",
            most=0.25,
        ),
        lambda plane, name: Rule(
            name,
            "noise from sample to sample",
            partial(_noise, plane),
            "look at what the camera measured, and record again",
            most=3.0,
            unit="deg",
        ),
        lambda plane, name: Rule(
            name,
            "share of samples beyond the cup's rim",
            partial(_beyond_rim, plane),
            "give it in rad, or measure cup_radius, cup_height and z again",
            most=0.02,
        ),
    ),
    Rule(
        ", ".join(PLANES),
        "largest inclination",
        _lean,
        "give it in rad: it is converted from degrees once only",
        least=0.2,
        unit="deg",
    ),
)
SCENE = (
    Rule(
        "x, y",
        "room between stick and wall",
        _room,
        "shift x and y to the cup's axis, or correct cup_radius",
        least=0.0,
        unit="m",
    ),
    Rule("x, y", "travel", _travel, "record a stir, in m", least=1e-3, unit="m"),
    Rule(
        "z, stick_length, fill",
        "depth of the stick in the liquid",
        _depth,
        "z counts from the cup's floor: correct z, stick_length or fill",
        least=1e-6,
        unit="m",
    ),
    Rule(
        "z, stick_length",
        "lowest place of the tip",
        _lowest_tip,
        "z counts from the cup's floor: correct z or stick_length",
        least=0.0,
        unit="m",
    ),
    Rule(
        f"attribute {' or '.join(STICK_WEIGHT)}",
        "buoyancy / weight",
        _buoyancy,
        "weigh the stick again; it must hang",
        most=BELOW,
    ),
)
