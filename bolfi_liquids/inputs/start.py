"""Whether a recording starts as a simulation does: gripper, stick and liquid at rest.

A stir that is cut out of a longer one starts in motion. A simulation from rest then differs from it
for a reason that is not the liquid, and the liquid is taken for a thinner or a thicker one.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..wording import command
from .recording import PLANE_NAMES, Recording, steps

FIRST_TIME = 0.15
"""Time from which the speed at the start is extrapolated [s]."""
REST_TIME = 0.3
"""Time for which gripper and stick must stay where they are to be seen to rest [s]."""
SETTLING_TIME = 0.3
"""Time in which a gripper that has just come down may come to rest [s]: an arm lags its plan."""
MAX_SPEED_SHARE = 0.1
"""Of the gripper's usual speed, up to which it starts from rest."""
MAX_SWING = np.radians(1.5)
"""By which the stick may swing or lean at the start [rad]: lowering it leaves some."""
MAX_OFFSET = np.radians(3.0)
"""By which a stick that stands still may seem to lean [rad]: its cameras are tilted."""
NOISE_FACTOR = 4.0
"""Standard deviations that are no motion."""
MIN_STIR = 1.0
"""Time that is left of a stir that is worth cutting to [s]."""
MIN_TRAVEL = 5e-3
"""Travel of the gripper that is left of a stir that is worth cutting to [m]."""


def check_start(recording: Recording) -> None:
    """Raise `InputError` where gripper or stick move in the first samples, or are in the air."""
    if (fault := _fault(recording, 0, *_usual(recording))) is None:
        return
    field, what = fault
    if (rest := first_rest(recording)) is None:
        fix = "record from rest: it holds no rest before a stir that it could be cut to"
    else:
        cut = command("trim", recording.path, "--start", f"{rest:.3f}", "--out", "FILE.nc")
        fix = f"record from rest, or cut it: {cut}"
    raise InputError(what, where=f"{recording.path}: {field}", fix=fix)


def above_liquid(recording: Recording, first: int = 0) -> float:
    """Height of the stick's tip above the liquid at a sample [m]; negative within it."""
    height = recording.gripper.position[first:, 2]
    tip = height[np.isfinite(height)][0] - recording.number("stick_length")
    return float(tip - recording.number("fill"))


def first_rest(recording: Recording) -> float | None:
    """First time at which gripper and stick rest in the liquid, before they stir it [s].

    Returns:
        On the recording's clock; None where there is no such time.
    """
    if np.isfinite(recording.gripper.position).all(axis=1).sum() < 2:
        return None
    usual = _usual(recording)
    for first in _candidates(recording, *usual[:2]):
        if _rests(recording, first) and _fault(recording, first, *usual) is None:
            return float(np.floor(1000.0 * recording.time[first]) / 1000.0)
    return None


def noise_of(values: NDArray) -> float:
    """Standard deviation of the white noise of samples, by what a cubic does not explain."""
    seen = values[np.isfinite(values)]
    if len(seen) < 5:
        return 0.0
    return float(1.4826 * np.median(np.abs(np.diff(seen, 4))) / np.sqrt(70.0))


def _usual(recording: Recording) -> tuple[float, float, float]:
    """Speed of the stir [m/s], noise of the position [m] and of the inclination [rad]."""
    time, position = recording.time, recording.gripper.position
    seen = np.isfinite(position).all(axis=1)
    way, step = steps(time[seen], position[seen])
    fast = float(np.quantile(way / step, 0.9))
    still = max(map(noise_of, position.T))
    return fast, still, max(map(noise_of, recording.inclination.T))


def _fault(
    recording: Recording, first: int, fast: float, still: float, noise: float
) -> tuple[str, str] | None:
    """Reason against a start at a sample: the field, and its behaviour."""
    if (above := above_liquid(recording, first)) >= 0.0:
        return "z", f"starts with the stick in the air, {100.0 * above:.1f} cm above the liquid"
    speed, error = _first_speed(recording, first, still)
    if speed > max(MAX_SPEED_SHARE * fast, NOISE_FACTOR * error):
        if _settled(recording, first) is None:
            return "x, y, z", f"starts in motion: the gripper moves at {100 * speed:.1f} cm/s"
    lean, change = _lean(recording, first)
    rests, slack = _rests(recording, first), NOISE_FACTOR * noise
    steady = rests and (change < 0.5 * MAX_SWING + slack).all()
    at, swings = int(np.argmax(lean)), int(np.argmax(change))
    if lean[at] > (MAX_OFFSET if steady else MAX_SWING) + slack:
        what = f"starts in motion: the stick leans by {np.degrees(lean[at]):.1f} deg"
        return f"inclination_{PLANE_NAMES[at]}", what
    if rests and change[swings] > MAX_SWING + slack:
        what = f"starts in motion: the stick swings by {np.degrees(change[swings]):.1f} deg"
        return f"inclination_{PLANE_NAMES[swings]}", what
    return None


def _first_speed(recording: Recording, first: int, still: float) -> tuple[float, float]:
    """Speed of the gripper at a sample, and what noise makes of it [m/s].

    A parabola is extrapolated to it, for a stir that starts there accelerates.
    """
    time, position = _within(recording, first, FIRST_TIME, recording.gripper.position)
    if len(time) < 3:
        return 0.0, 0.0
    powers = np.vander(time, 3, increasing=True)
    solve = np.linalg.pinv(powers)
    speed = float(np.linalg.norm(solve[1] @ position))
    return speed, still * float(np.linalg.norm(solve[1])) * np.sqrt(3.0)


def _lean(recording: Recording, first: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inclination at a sample in both planes, and how far it is later on, [rad], shape (2,)."""
    _, angle = _within(recording, first, REST_TIME, recording.inclination)
    if len(angle) < 3:
        return np.zeros(2), np.zeros(2)
    begins = angle[:3].mean(axis=0)
    return np.abs(begins), np.abs(angle - begins).max(axis=0)


def _rests(recording: Recording, first: int) -> bool:
    """Whether the gripper stays where it is for `REST_TIME`."""
    time, position = _within(recording, first, REST_TIME, recording.gripper.position)
    if len(time) < 3 or time[-1] < 0.5 * REST_TIME:
        return False
    still = max(map(noise_of, recording.gripper.position.T))
    moved = np.linalg.norm(position - position[:3].mean(axis=0), axis=1)
    return bool(moved.max() < max(2e-4, 2.0 * NOISE_FACTOR * still))


def _settled(recording: Recording, first: int) -> int | None:
    """First sample from which the gripper rests, soon after another one; None if it does not."""
    later = recording.time[first:] - recording.time[first]
    near = first + np.flatnonzero(later <= SETTLING_TIME)
    return next((int(at) for at in near if _rests(recording, int(at))), None)


def _within(
    recording: Recording, first: int, duration: float, values: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times since a sample [s], and whole rows of values, for so long after it, or for three."""
    time = recording.time[first:] - recording.time[first]
    part = time <= max(duration, *time[:3])
    part &= np.isfinite(values[first:]).all(axis=1)
    return time[part], values[first:][part]


def _candidates(recording: Recording, fast: float, still: float) -> Iterator[int]:
    """Samples that may be starts: the gripper is slow, and stirs later."""
    time, position = recording.time, recording.gripper.position
    seen = np.flatnonzero(np.isfinite(position).all(axis=1))
    way, step = steps(time[seen], position[seen])
    slow = way < MAX_SPEED_SHARE * fast * step + 2.0 * NOISE_FACTOR * still
    for at in np.flatnonzero(slow):
        first = int(seen[at])
        later = position[first:, :2]
        far = np.linalg.norm(later - later[0], axis=1)
        if time[-1] - time[first] >= MIN_STIR and np.nanmax(far) >= MIN_TRAVEL:
            yield first
