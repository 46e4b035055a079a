"""A liquid column that collapses over a dry floor: Martin & Moyce 1952.

Martin & Moyce, Phil. Trans. R. Soc. A 244, 312. A column of base a (2.25 in) and height n² a,
two-dimensional, released by a diaphragm. Dimensionless: front Z = x/a over T = n t sqrt(g/a);
remaining height H = η/(n² a) over τ = t sqrt(g/a). Values as tabulated by public solvers that
validate against them (Ocellaris, Trixi, Lethe).

When the diaphragm is out of the way is uncertain by some tenths of T, and those solvers shift
time to make up for it. So compare `front_speed`, which no shift changes, or `fit_time_shift`.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

BASE = 0.05715  # m, 2.25 in
LARGEST_SHIFT = 0.5  # of T, beyond what a diaphragm explains


class Track(NamedTuple):
    """A dimensionless length [n] over dimensionless time [n]."""

    time: np.ndarray
    value: np.ndarray


class TimeShift(NamedTuple):
    """The shift of our time that fits best, and the RMS difference of values that is left."""

    shift: float
    rms: float


def _track(text: str) -> Track:
    pairs = np.array([pair.split("/") for pair in text.split()], float)
    return Track(pairs[:, 0], pairs[:, 1])


FRONT = {
    1: _track(
        ".43/1.11 .62/1.22 .80/1.44 .97/1.67 1.14/1.89 1.29/2.11 1.45/2.33 1.62/2.56 1.76/2.78 "
        "1.93/3.00 2.07/3.22 2.24/3.44 2.40/3.67 2.54/3.89 2.71/4.11 2.87/4.33 3.04/4.56 3.21/4.78"
    ),
    2: _track(
        ".41/1.11 .84/1.22 1.19/1.44 1.43/1.67 1.63/1.89 1.83/2.11 1.98/2.33 2.20/2.56 2.32/2.78 "
        "2.51/3.00 2.65/3.22 2.83/3.44 2.98/3.67 3.11/3.89 3.33/4.11"
    ),
}
"""Z over T by aspect ratio n² = height / base."""

HEIGHT = {
    1: _track(".80/.89 1.29/.78 1.74/.67 2.15/.56 2.57/.44 3.08/.33 4.27/.22"),
    2: _track(
        ".56/.94 .77/.89 .93/.83 1.08/.78 1.28/.72 1.46/.67 1.66/.61 1.84/.56 2.00/.50 2.21/.44 "
        "2.45/.39 2.70/.33 3.06/.28 3.44/.22 4.20/.17 5.25/.11"
    ),
}
"""H over τ by aspect ratio."""

REPEATED_FRONT = _track(
    "1.25/1.44 1.47/1.67 1.63/1.89 1.76/2.11 1.95/2.33 2.05/2.56 2.18/2.78 2.27/3.00 2.51/3.22 "
    "2.56/3.44 2.74/3.67 3.01/4.00 3.39/4.56 3.73/5.00 4.06/5.56 4.39/6.00 5.06/7.00 5.76/8.00"
)
"""Another tabulation of n² = 2: the mean T of several releases, which differ by 0.1 of T.

Its front is a fifth faster than that of `FRONT[2]`: no comparison with either can be closer.
"""


def front_time(time: ArrayLike, aspect: float, base: float, gravity: float = 9.81) -> np.ndarray:
    """T of `FRONT` at times [s] of a column of `base` [m] and height aspect times base."""
    return np.asarray(time, float) * np.sqrt(aspect * gravity / base)


def height_time(time: ArrayLike, base: float, gravity: float = 9.81) -> np.ndarray:
    """τ of `HEIGHT` at times [s]."""
    return np.asarray(time, float) * np.sqrt(gravity / base)


def front_speed(track: Track, low: float = 1.5, high: float = 3.9) -> float:
    """Slope dZ/dT over the stretch of the track with Z from `low` to `high`.

    From 1.5 on both columns' fronts are past their start, and before 3.9 both tables end.

    Raises:
        ValueError: fewer than three points lie on that stretch.
    """
    inside = (track.value >= low) & (track.value <= high)
    if inside.sum() < 3:
        raise ValueError(f"the front has {inside.sum()} points from {low} to {high}; it needs 3")
    return float(np.polyfit(track.time[inside], track.value[inside], 1)[0])


def fit_time_shift(ours: Track, table: Track, largest: float = LARGEST_SHIFT) -> TimeShift:
    """The one shift of our time for which our values at the table's times fit best.

    Before our first time the column stands still; table points after our last are left out.

    Raises:
        ValueError: fewer than three are left.
    """
    reached = table.time + largest <= ours.time.max()
    if reached.sum() < 3:
        raise ValueError(
            f"our times end at {ours.time.max():.3g}, and {reached.sum()} points of the table lie "
            f"{largest:g} or more before that; simulate longer"
        )
    time, value = table.time[reached], table.value[reached]

    def rms(shift: float) -> float:
        return float(np.sqrt(np.mean((np.interp(time - shift, *ours) - value) ** 2)))

    # a scan first: a rough front has several minima
    coarse = np.linspace(-largest, largest, 101)
    best = coarse[np.argmin([rms(s) for s in coarse])]
    step = coarse[1] - coarse[0]
    fine: Any = minimize_scalar(rms, bounds=(best - step, best + step), method="bounded")
    return TimeShift(float(fine.x), rms(float(fine.x)))
