"""What a recording's values must satisfy for a simulator to replay it: one table of rules.

Limits are those of sticks and cups that are stirred by hand or arm. A value in another unit than
that of the file lies outside of them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .limits import ABOVE_0, BELOW_1, INF, Limits, checked_number
from .recording import AXES, JUMPS, PLANES, STICK_WEIGHT, Recording, steps, torn_values
from .start import above_liquid, noise_of

REMEASURE = "give a number in SI units, or measure it again"
SIZES = {
    "cup_radius": Limits("", 5e-3, 0.25, "m", REMEASURE),
    "cup_height": Limits("", 5e-3, 0.5, "m", REMEASURE),
    "fill": Limits("", 1e-3, 0.5, "m", REMEASURE),
    "stick_radius": Limits("", 2e-4, 0.05, "m", REMEASURE),
    "stick_length": Limits("", 0.02, 1.0, "m", REMEASURE),
    "liquid_density": Limits("", 50.0, 20_000.0, "kg/m3", REMEASURE),
    "stick_density": Limits("", 50.0, 20_000.0, "kg/m3", REMEASURE),
    "stick_mass": Limits("", ABOVE_0, 2.0, "kg", REMEASURE),
}
"""Limits of each attribute."""

OUTER = {"fill": "cup_height", "stick_radius": "cup_radius"}
"""Sizes that must be smaller than another one."""

MAX_GRIPPER_GAP = 0.2
"""Longest gap in the gripper's path that is interpolated [s]: less than half a stroke."""
MIN_SEEN = 0.5
"""Smallest share of a plane's samples in which the stick must have been seen."""
MIN_FROZEN_TIME = 0.25
"""Time of equal numbers that is no coincidence of a coarse scale [s]."""
MAX_STAIRS = 0.05
"""Usual time between updates of a value that is held in between [s]: half of it is a delay."""
MIN_LEVELS_SHARE = 0.5
"""Of different values among those that are held: a coarse scale shows fewer again and again."""
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

Measured = float | tuple[float, str]
"""A value, perhaps with where or how it came about."""


class Rule(NamedTuple):
    """A quantity of a recording, and its limits.

    Attributes:
        fields: Variables or attributes that it holds for, one by one.
        measure: Its value in a recording for a field; NaN lies outside of all limits.
        limits: With the remedy.
    """

    fields: tuple[str, ...]
    measure: Callable[[Recording, str], Measured]
    limits: Limits

    def check(self, recording: Recording, hint: str = "") -> None:
        """Raise `InputError` outside of the limits; `hint` ends the remedy."""
        limits = self.limits._replace(fix=f"{self.limits.fix}{hint}")
        for field in self.fields:
            measured = self.measure(recording, field)
            value, note = measured if isinstance(measured, tuple) else (measured, "")
            attribute = "attribute " if field in SIZES else ""
            limits.check(value, f"{recording.path}: {attribute}{field}", note)


def check_values(recording: Recording, hint: str = "") -> None:
    """Raise `InputError` at the first value that no simulator could use.

    Args:
        recording: The recording.
        hint: What else may help, at the end of each remedy.
    """
    for name, limits in SIZES.items():
        if name in recording.attrs or name not in STICK_WEIGHT:
            Rule((name,), _size, limits).check(recording, hint)
    for rule in RULES:
        rule.check(recording, hint)


def check_times(recording: Recording) -> None:
    """Raise `InputError` unless the times increase."""
    for rule in TIMES:
        rule.check(recording)


def _size(recording: Recording, field: str) -> Measured:
    """An attribute, which must be a number."""
    return checked_number(recording.attrs.get(field), f"{recording.path}: attribute {field}")


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


def _missing_times(recording: Recording, field: str) -> Measured:
    missing = np.isnan(recording.time)
    return int(missing.sum()), f" (the first is of sample {int(missing.argmax())})"


def _repeated(recording: Recording, field: str) -> Measured:
    stamps, counts = np.unique(recording.time, return_counts=True)
    count, distinct = len(recording.time), len(stamps)
    decimals = next((n for n in range(9) if np.array_equal(stamps.round(n), stamps)), 9)
    first = f"{stamps[counts.argmax()]:.13g} s"
    return count - distinct, (
        f" ({count} stamps, {distinct} distinct, of {decimals} decimals; such as {first})"
    )


def _shortest_step(recording: Recording, field: str) -> Measured:
    step = np.diff(recording.time)
    at = int(step.argmin())
    before, after = recording.time[at : at + 2]
    return float(step[at]), f" from time[{at}] = {before:.13g} s to time[{at + 1}] = {after:.13g} s"


def _usual_step(recording: Recording, field: str) -> Measured:
    return float(np.median(np.diff(recording.time)))


def clock_difference(time: NDArray, position: NDArray, inclination: NDArray) -> float:
    """Gap between two logs of which one ends before the other begins [s]; 0 for overlap.

    Args:
        time: Times of all samples [s], shape (T,).
        position: Of the gripper [m], shape (T, 3); NaN where it is missing.
        inclination: Of the stick [rad], shape (T, 2); likewise.
    """
    arm = time[np.isfinite(position).any(axis=1)]
    camera = time[np.isfinite(inclination).any(axis=1)]
    if not len(arm) or not len(camera) or (arm[0] <= camera[-1] and camera[0] <= arm[-1]):
        return 0.0
    return float(abs(camera[0] - arm[0]))


def _clock_difference(recording: Recording, field: str) -> Measured:
    return clock_difference(*recording.gripper, recording.inclination)


def _part(recording: Recording, field: str) -> Measured:
    """Outer size."""
    part, whole = recording.number(field), recording.number(OUTER[field])
    return part / whole, f" of {OUTER[field]} ({part:g} m of {whole:g} m)"


def _made_density(recording: Recording, field: str) -> Measured:
    """Density of a stick that was weighed; 0 for one that was not."""
    volume = np.pi * recording.number("stick_radius") ** 2 * recording.number("stick_length")
    mass = float(recording.attrs.get("stick_mass", 0.0))
    return mass / volume, f" (of {mass:g} kg)"


def _largest(recording: Recording, field: str) -> Measured:
    values = recording.values(field)
    return float(np.abs(values[~np.isnan(values)]).max(initial=0.0))


def _gap(recording: Recording, field: str) -> Measured:
    duration, start = longest_gap(recording.time, ~np.isnan(recording.values(field)))
    return duration, f" from {start:.2f} s on"


def _usual_speed(recording: Recording, field: str) -> Measured:
    seen = np.isfinite(recording.gripper.position).all(axis=1)
    way, step = steps(recording.time[seen], recording.gripper.position[seen])
    return float(np.median(way / step))


def _seen(recording: Recording, field: str) -> Measured:
    missing = np.isnan(recording.values(field))
    return 1.0 - missing.mean(), f" (NaN in {missing.sum()} of {len(missing)})"


def _torn(recording: Recording, field: str) -> Measured:
    """Samples that jump out and back; a few of them are missing already."""
    torn = np.any([torn_values(recording.values(name), JUMPS[name]) for name in JUMPS], axis=0)
    first = int(torn.argmax())
    return int(torn.sum()), (
        f" of {len(torn)}, the first is sample {first} at {recording.time[first]:.13g} s"
    )


def _jump(recording: Recording, field: str) -> Measured:
    """Greatest speed from one sample to the next, of those further apart than a torn value."""
    seen = np.flatnonzero(np.isfinite(recording.gripper.position).all(axis=1))
    way, step = steps(recording.time[seen], recording.gripper.position[seen])
    speed = np.where(way > JUMPS["x"], way / step, 0.0)
    at = int(speed.argmax())
    return float(speed[at]), f" over {way[at]:.3g} m after sample {seen[at]}"


def _frozen(recording: Recording, field: str) -> tuple[float, float, str]:
    """Time of one and the same number while the gripper moves: longest [s], and share of all."""
    values, time, position = recording.values(field), *recording.gripper
    seen = np.isfinite(values) & np.isfinite(position).all(axis=1)
    way, step = steps(time[seen], position[seen])
    moving = way > MIN_SPEED_SHARE * float(np.quantile(way / step, 0.9)) * step
    same = np.diff(values[seen]) == 0.0
    if not (moving & same).any():
        return 0.0, 0.0, ""
    runs = np.cumsum(~same)[same]  # intervals without change, by what they follow
    _, starts, run = np.unique(runs, return_index=True, return_inverse=True)
    lasts = np.bincount(run, weights=np.where(moving, step, 0.0)[same])
    at = np.flatnonzero(same)[starts[int(lasts.argmax())]]
    note = f" at {float(values[seen][at]):g} rad from {time[seen][at]:.2f} s on"
    share = lasts[lasts > MIN_FROZEN_TIME].sum() / step[moving].sum()
    return float(lasts.max()), float(share), note


def _frozen_time(recording: Recording, field: str) -> Measured:
    longest, _, note = _frozen(recording, field)
    return longest, note


def _frozen_share(recording: Recording, field: str) -> Measured:
    _, share, note = _frozen(recording, field)
    return share, note


def _stairs(recording: Recording, field: str) -> Measured:
    """Usual time between updates of what is held from sample to sample; 0 if nothing is [s].

    The levels of a stair differ from each other, while the steps of a coarse scale are few.
    """
    values = recording.values(field) if field in PLANES else recording.gripper.position
    values = values.reshape(len(recording.time), -1)
    seen = np.isfinite(values).all(axis=1)
    time, values = recording.time[seen], values[seen]
    way, step = steps(time, values)
    updates = np.flatnonzero(way > 0.0)
    if len(updates) < 2:
        return 0.0
    between, usual = float(np.median(np.diff(time[updates]))), float(np.median(step))
    levels = len(np.unique(values[updates], axis=0))
    if between < 1.5 * usual or levels < MIN_LEVELS_SHARE * len(updates):
        return 0.0
    return between, f" (updates at {1.0 / between:.3g} Hz in samples at {1.0 / usual:.3g} Hz)"


def _noise_deg(recording: Recording, field: str) -> Measured:
    values = recording.values(field)
    noise = noise_of(values)
    return float(np.degrees(noise)) if noise > MAX_NOISE_SHARE * np.nanstd(values) else 0.0


def _beyond_rim(recording: Recording, field: str) -> Measured:
    """Share of samples in which the stick leans further than the rim of its cup lets it."""
    above = float(np.nanmin(recording.gripper.position[:, 2])) - recording.number("cup_height")
    if above <= 0.0:
        return 0.0
    most = np.arctan2(2.0 * recording.number("cup_radius"), above)
    values = recording.values(field)
    size = np.abs(values[np.isfinite(values)])
    note = f" (up to {size.max():.3g} rad, where the rim stops the stick at {most:.2g} rad)"
    return float((size > most + RIM_MARGIN).mean()), note


def _lean_deg(recording: Recording, field: str) -> Measured:
    """Lean of the stick behind a fast gripper [deg]; infinite where it is slow."""
    known = np.isfinite(recording.gripper.position).all(axis=1)
    time, position = recording.time[known], recording.gripper.position[known]
    apart = np.searchsorted(time, time[0] + SPEED_TIME)  # samples; so far apart noise is no speed
    way = np.linalg.norm(position[apart:] - position[:-apart], axis=1)
    speed = way / (time[apart:] - time[:-apart])
    fast = float(np.quantile(speed, 0.9)) if len(speed) else 0.0
    leans = [np.abs(plane - np.nanmedian(plane)) for plane in recording.inclination.T]
    lean = max(float(np.degrees(np.nanquantile(one, 0.99))) for one in leans)
    return np.inf if fast < MIN_FAST else lean, f" while the gripper moves at {fast:.2g} m/s"


def _room(recording: Recording, field: str) -> Measured:
    """Between the stick at its pivot and the wall of the cup."""
    x, y, _ = recording.gripper.position.T
    radius, cup = float(np.nanmax(np.hypot(x, y))), recording.number("cup_radius")
    note = f" (the gripper goes {radius:g} m from the axis, cup_radius is {cup:g} m)"
    return cup - recording.number("stick_radius") - radius, note


def _travel(recording: Recording, field: str) -> Measured:
    path = recording.gripper.position[:, :2]
    return float((np.nanmax(path, axis=0) - np.nanmin(path, axis=0)).max())


def _lowest_tip(recording: Recording) -> float:
    return float(np.nanmin(recording.values("z"))) - recording.number("stick_length")


def _above_floor(recording: Recording, field: str) -> Measured:
    return _lowest_tip(recording)


def _depth(recording: Recording, field: str) -> Measured:
    """Depth of the tip in the liquid, at its lowest."""
    tip, fill = _lowest_tip(recording), recording.number("fill")
    return fill - tip, f" (the tip is {tip:g} m above the floor, the liquid is {fill:g} m deep)"


def _buoyancy(recording: Recording, field: str) -> Measured:
    """Moment of buoyancy about the pivot over that of the weight."""
    from ..models import StirSetup

    if above_liquid(recording) >= 0.0:
        return 0.0  # nothing lifts it there, and `check_start` refuses it
    setup = StirSetup.from_recording(recording)
    stick, wet, mass = setup.stick, setup.submerged, setup.stick.mass
    displaced = recording.number("liquid_density") * np.pi * stick.radius**2 * wet
    lifted = displaced * (stick.length - wet / 2)
    return lifted / (mass * stick.length / 2), f" (a stick of {1000 * mass:.3g} g floats up)"


TIME, WEIGHT = ("time",), (" or ".join(STICK_WEIGHT),)
PATH, XY, ALL, TIP = (", ".join(AXES),), ("x, y",), (", ".join(JUMPS),), ("z, stick_length",)
LEANS = (", ".join(PLANES),)
MEASURE, AGAIN = "measure both again, in m", "look at what was measured, and record again"
MASS = "give the mass in kg, or measure the stick again"
ORDER = "sort the samples by time; where a clock was set back, add what it lost"
STAMP = "give each sample its time, or leave out its row"
STILL = "mark samples of a camera that stood still by NaN, or record again"
HELD = "mark samples between updates by NaN, or give each its own value"
CLOCKS = "shift the stamps of one log onto the other's clock"
DECIMALS = "write times with more decimals, or import a table with `rate_hz` in its map"
ANGLE = "give it in rad from the downward vertical, and NaN where the stick was not seen"
ONCE = "give it in rad: convert degrees once only"
RIM = "give it in rad, or measure cup_radius, cup_height and z again"
FLOOR = "z counts from the cup's floor: correct z, stick_length or fill"
AXIS = "shift x and y to the cup's axis, or correct cup_radius"
CUT = "cut the recording before it"
FROZEN = "of one number while the gripper moves"

TIMES = (
    Rule(TIME, lambda r, _: len(r.time), Limits("number of samples", 10, INF, "", "record more")),
    Rule(TIME, _missing_times, Limits("missing stamps", 0, 0, "", STAMP)),
    Rule(TIME, _repeated, Limits("repeated stamps", 0, 0, "", DECIMALS)),
    Rule(TIME, _shortest_step, Limits("shortest step", 1e-9, INF, "s", ORDER)),
)
RULES = (
    *TIMES,
    Rule(TIME, _usual_step, Limits("usual step", 0, 1, "s", "give times in s")),
    Rule(("stick_mass",), _made_density, Limits("density", 0, 25e3, "kg/m3", MASS)),
    Rule(tuple(OUTER), _part, Limits("part", 0, BELOW_1, "", MEASURE)),
    Rule(TIME, _clock_difference, Limits("difference of the clocks", 0, 0, "s", CLOCKS)),
    Rule(AXES, _largest, Limits("largest position", 0, 2, "m", "give positions in m")),
    Rule(AXES, _gap, Limits("longest time without a position", 0, MAX_GRIPPER_GAP, "s", CUT)),
    Rule(
        TIME, _usual_speed, Limits("usual speed", 0, 1, "m/s", "give times in s and positions in m")
    ),
    Rule(
        PLANES,
        _seen,
        Limits("share of samples with the stick in sight", MIN_SEEN, 1, "", "record again"),
    ),
    Rule(PLANES, _gap, Limits("longest time without an inclination", 0, 0.5, "s", CUT)),
    Rule(PLANES, _largest, Limits("largest inclination", 0, np.pi / 2, "rad", ANGLE)),
    Rule(ALL, _torn, Limits("samples that jump out and back", 0, 0, "", AGAIN)),
    Rule(PATH, _jump, Limits("speed of a jump", 0, 2.5, "m/s", AGAIN)),
    Rule(PLANES, _frozen_time, Limits(f"longest time {FROZEN}", 0, 1, "s", STILL)),
    Rule(PLANES, _frozen_share, Limits(f"share of the time {FROZEN}", 0, 0.25, "", STILL)),
    Rule((*PATH, *PLANES), _stairs, Limits("stairs", 0, MAX_STAIRS, "s", HELD)),
    Rule(PLANES, _noise_deg, Limits("noise from sample to sample", 0, 3, "deg", AGAIN)),
    Rule(PLANES, _beyond_rim, Limits("share of samples beyond the cup's rim", 0, 0.02, "", RIM)),
    Rule(LEANS, _lean_deg, Limits("largest inclination", 0.2, INF, "deg", ONCE)),
    Rule(XY, _room, Limits("room between stick and wall", 0, INF, "m", AXIS)),
    Rule(XY, _travel, Limits("travel", 1e-3, INF, "m", "record a stir, in m")),
    Rule(TIP, _depth, Limits("depth of the stick in the liquid", 1e-6, INF, "m", FLOOR)),
    Rule(TIP, _above_floor, Limits("height of the tip above the floor", 0, INF, "m", FLOOR)),
    Rule(
        WEIGHT,
        _buoyancy,
        Limits("buoyancy / weight", 0, BELOW_1, "", "weigh the stick; it must hang"),
    ),
)
