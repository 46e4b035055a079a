"""What is judged of several liquids' pours together: means, and what the contact angle changes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..models.validation import Row
from .pour_bars import MAX_MEAN_EXCESS, MAX_MEAN_RMS, max_shift_error
from .reference_pours import PouredLiquid, ReferencePour

MEAN_RMS = "mean RMS"
MEAN_EXCESS = "mean spilled beyond the least"
LARGEST_SHIFT = 0.02  # m, that is looked for
MIN_OVERLAP = 3  # distances that two curves must share

Records = Mapping[str, Mapping[str, Any]]


def across_pours(liquids: Iterable[PouredLiquid], records: Records) -> tuple[Row, ...]:
    """Comparisons that need several pours.

    Args:
        liquids: All of the reference.
        records: By name; liquids without a record, or with one that raised, are left out, and means
            over tables of such liquids.
    """
    liquids = tuple(liquids)
    done = [one for one in liquids if one.name in records and records[one.name]["panels"]]
    partial = {one.table for one in liquids if one not in done}
    tables = dict.fromkeys(one.table for one in done if one.table not in partial)
    means = [row for table in tables for row in _means(table, done, records)]
    return (*means, *_shifts(done, records))


def _means(table: str, done: Iterable[PouredLiquid], records: Records) -> Iterator[Row]:
    """Of all pours of a table, whatever the liquid."""
    own = [one for one in done if one.table == table]
    pours = [pour for one in own for pour in records[one.name]["notes"]["pours"]]
    rms = [pour["rms"] for pour in pours if pour["rms"] is not None]
    if rms:
        yield Row.absolute(f"{MEAN_RMS}, {table}", 0.0, float(np.mean(rms)), MAX_MEAN_RMS)
    excess = _numbers(pour["excess"] for pour in pours)
    yield Row.absolute(f"{MEAN_EXCESS}, {table}", 0.0, excess.mean(), MAX_MEAN_EXCESS)


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
    from scipy.interpolate import PchipInterpolator
    from scipy.optimize import minimize_scalar

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


def _shifts(done: Sequence[PouredLiquid], records: Records) -> Iterator[Row]:
    """A row for each two pours of one liquid at one speed from cups that it wets differently."""
    for wetting, less in _pairs(done):
        noted = [records[one.name]["notes"]["pours"] for one in (wetting, less)]
        for at, pour in enumerate(wetting.pours):
            speeds = np.isclose(less.angular_velocity, pour.angular_velocity)
            for other in np.flatnonzero(speeds):
                curves = (
                    _Curves.of(pour, noted[0][at]),
                    _Curves.of(less.pours[other], noted[1][other]),
                )
                yield from _shift_row(wetting, less, curves)


def _pairs(done: Iterable[PouredLiquid]) -> Iterator[tuple[PouredLiquid, PouredLiquid]]:
    """Liquids that are the same but for the contact angle, which grows from one to the next."""
    groups: dict[tuple, list[PouredLiquid]] = {}
    for one in done:
        truths = one.viscosity, one.density, one.surface_tension, one.cups.pour.hold
        groups.setdefault((one.liquid, *truths), []).append(one)
    for group in groups.values():
        yield from pairwise(group)


class _Curves(NamedTuple):
    """Spilled over distance as a share of what left the cup: the films in the cups differ, too."""

    speed: str
    distance: NDArray[np.float64]
    reference: NDArray[np.float64]
    simulated: NDArray[np.float64]

    @classmethod
    def of(cls, pour: ReferencePour, noted: Mapping[str, Any]) -> "_Curves":
        retained = _numbers([noted["retained"]])
        return cls(
            f"{np.degrees(pour.angular_velocity):g} deg/s",
            pour.distance,
            pour.spilled / (1.0 - pour.retained),
            _numbers(noted["spilled"]) / (1.0 - retained),
        )


def _shift_row(
    wetting: PouredLiquid, less: PouredLiquid, curves: tuple[_Curves, _Curves]
) -> Iterator[Row]:
    """The shift of the landing [mm]; nothing where the pours share too few distances."""
    first, second = curves
    shared, here, there = np.intersect1d(first.distance, second.distance, return_indices=True)
    if len(shared) < MIN_OVERLAP:
        return
    angles = f"{wetting.contact_angle_deg:g} to {less.contact_angle_deg:g} deg"
    truth = shift(shared, first.reference[here], second.reference[there])
    ours = shift(shared, first.simulated[here], second.simulated[there])
    quantity = f"shift, {wetting.liquid} {first.speed}, {angles} [mm]"
    bar = 1e3 * max_shift_error(wetting.viscosity)
    yield Row.absolute(quantity, 1e3 * truth, 1e3 * ours, bar)


def _numbers(values: Iterable[float | None]) -> NDArray[np.float64]:
    """NaN for what a record has as none: a simulation failed."""
    return np.array(list(values), float)
