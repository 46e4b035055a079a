"""What is judged of several liquids' pours together: means, and what the contact angle changes."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from case import Row
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize_scalar

from .pour_bars import MAX_MEAN_EXCESS, MAX_MEAN_RMS, max_shift_error
from .pour_replay import RepeatedPour
from .pours import PouredLiquid, ReferencePour

LARGEST_SHIFT = 0.02  # m, that is looked for
MIN_OVERLAP = 3  # distances that two curves must share

Repeated = tuple[PouredLiquid, Sequence[RepeatedPour]]
"""A liquid, and the repetition of each of its pours."""


def mean_rows(table: str, repeated: Iterable[RepeatedPour]) -> tuple[Row, ...]:
    """Means over all pours of a table, whatever the liquid."""
    repeated = tuple(repeated)
    excess = float(np.mean([one.excess for one in repeated]))
    rows = [Row.absolute(f"mean spilled beyond the least, {table}", 0.0, excess, MAX_MEAN_EXCESS)]
    if rms := [one.rms for one in repeated if one.rms is not None]:
        rows.insert(0, Row.absolute(f"mean RMS, {table}", 0.0, float(np.mean(rms)), MAX_MEAN_RMS))
    return tuple(rows)


def wetting_pairs(liquids: Iterable[PouredLiquid]) -> list[tuple[PouredLiquid, PouredLiquid]]:
    """Liquids that are the same but for the contact angle, which grows from one to the next."""
    groups: dict[tuple, list[PouredLiquid]] = {}
    for one in liquids:
        truths = one.viscosity, one.density, one.surface_tension, one.cups.pour.hold
        groups.setdefault((one.liquid, *truths), []).append(one)
    return [pair for group in groups.values() for pair in pairwise(group)]


def shift_rows(wetting: Repeated, less: Repeated) -> tuple[Row, ...]:
    """By how much the landing moves with the angle [mm]: a row for each speed that both have."""
    return tuple(_shift_rows(wetting, less))


def _shift_rows(wetting: Repeated, less: Repeated) -> Iterator[Row]:
    """Nothing where the pours share too few distances."""
    liquid, other = wetting[0], less[0]
    for pour, ours in zip(liquid.pours, wetting[1], strict=True):
        for at in np.flatnonzero(np.isclose(other.angular_velocity, pour.angular_velocity)):
            first, second = _Curves.of(pour, ours), _Curves.of(other.pours[at], less[1][at])
            shared, here, there = np.intersect1d(
                first.distance, second.distance, return_indices=True
            )
            if len(shared) < MIN_OVERLAP:
                continue
            speed = f"{np.degrees(pour.angular_velocity):g} deg/s"
            angles = f"{liquid.contact_angle_deg:g} to {other.contact_angle_deg:g} deg"
            yield Row.absolute(
                f"shift, {liquid.liquid} {speed}, {angles} [mm]",
                1e3 * shift(shared, first.reference[here], second.reference[there]),
                1e3 * shift(shared, first.simulated[here], second.simulated[there]),
                1e3 * max_shift_error(liquid.viscosity),
            )


class _Curves(NamedTuple):
    """Spilled over distance as a share of what left the cup: the films in the cups differ, too."""

    distance: NDArray[np.float64]
    reference: NDArray[np.float64]
    simulated: NDArray[np.float64]

    @classmethod
    def of(cls, pour: ReferencePour, ours: RepeatedPour) -> "_Curves":
        return cls(
            pour.distance,
            pour.spilled / (1.0 - pour.retained),
            ours.spilled / (1.0 - ours.retained),
        )


def shift(
    distance: NDArray[np.float64], before: NDArray[np.float64], after: NDArray[np.float64]
) -> float:
    """By how much a curve of spilled over distance must be moved to lie best on another one [m].

    That is how much further the liquid lands, whatever the rest of the receivers catch. Least
    squares at the distances, of which at least `MIN_OVERLAP` stay within the moved curve.

    Args:
        distance: Ascending [m], shape (D,).
        before, after: Fractions, shape (D,).

    Returns:
        NaN if a fraction is missing.
    """
    if not (np.isfinite(before).all() and np.isfinite(after).all()):
        return float("nan")
    curve = PchipInterpolator(distance, before, extrapolate=False)

    def apart(by: float) -> float:
        off = curve(distance - by) - after
        shared = np.isfinite(off)
        return float(np.mean(off[shared] ** 2)) if shared.sum() >= MIN_OVERLAP else np.inf

    # a scan first: a curve that falls and rises has two minima
    coarse = np.linspace(-LARGEST_SHIFT, LARGEST_SHIFT, 161)
    best = coarse[int(np.argmin([apart(by) for by in coarse]))]
    step = coarse[1] - coarse[0]
    fine = minimize_scalar(apart, bounds=(best - step, best + step), method="bounded")
    return float(fine.x)
