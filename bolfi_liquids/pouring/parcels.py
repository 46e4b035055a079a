"""Where the liquid of a pour lands, in numbers that change smoothly with liquid and speed.

What a receiver catches changes abruptly where the stream meets its rim, but the stream itself moves
smoothly. So the liquid that leaves the source is cut into parcels of equal volume in the order of
where they land: a row is the root of the share that stays in the source, the places of all
parcels [m] from the lip, and their distances from the plane of the pour [m].
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..simulators import BatchOf

if TYPE_CHECKING:
    from ..models import Landings

PARCELS = 200  # with them fractions are within .002 RMS of those of all particles
ROW = 1 + 2 * PARCELS

PLACE_SCALE = 0.01  # m, of the middle parcel's place: about a stream's width
RETAINED_SCALE = 0.05  # of the root of the retained share, beside all parcels together


def scale() -> NDArray[np.float64]:
    """Differences that count alike in a row, shape (ROW,).

    The first and last parcels of a stream lie where chance puts them, so they count as the sampling
    errors of a normal distribution's quantiles say. With equal scales they ruled all components but
    the first, and the map missed left-out pours by a fifth more.
    """
    from scipy.stats import norm

    share = (np.arange(PARCELS) + 0.5) / PARCELS
    error = np.sqrt(share * (1.0 - share)) / norm.pdf(norm.ppf(share))
    ahead = PLACE_SCALE * error / error.min()
    across = np.full(PARCELS, PLACE_SCALE)
    return np.concatenate([[RETAINED_SCALE / np.sqrt(PARCELS)], ahead, across])


@dataclass(frozen=True)
class Parcels:
    """Where the liquid lands, as rows (B, ROW) of `parcels_of`."""

    def __call__(
        self, batch: BatchOf, theta: Mapping[str, NDArray], seeds: NDArray
    ) -> NDArray[np.float64]:
        from .. import models

        return parcels_of(models.landings(*batch(theta, seeds)))

    @property
    def settings(self) -> list[Any]:
        """The number of parcels."""
        return ["landed pours", PARCELS]


def parcels_of(landings: "Landings") -> NDArray[np.float64]:
    """Rows (B, ROW) of B pours; NaN where one diverged.

    What is still in the air counts as landing where the rest does.
    """
    rows = [_parcels(*one) for one in zip(landings.position, landings.retained, strict=True)]
    return np.stack(rows) if rows else np.zeros((0, ROW))


def _parcels(position: NDArray, retained: float) -> NDArray[np.float64]:
    if np.isnan(retained):
        return np.full(ROW, np.nan)
    landed = np.asarray(position[np.isfinite(position).all(axis=1)], np.float64)
    if not len(landed):  # nothing left the source
        landed = np.zeros((1, 2))
    ordered = landed[np.argsort(landed[:, 0], kind="stable")]
    ahead, square = _shares(ordered[:, 0]), _shares(ordered[:, 1] ** 2)
    return np.concatenate([[np.sqrt(retained)], ahead, np.sqrt(np.maximum(square, 0.0))])


def _shares(values: NDArray) -> NDArray[np.float64]:
    """Means of equal shares of values, shape (PARCELS,); a value may belong to two shares."""
    total = np.append(0.0, np.cumsum(values))
    ends = np.linspace(0.0, len(values), PARCELS + 1)
    share = len(values) / PARCELS
    return np.diff(np.interp(ends, np.arange(len(values) + 1), total)) / share


def fractions_of(rows: NDArray, distance: NDArray, radius: float) -> NDArray[np.float64]:
    """Fractions (n, D, 3) spilled, received and retained of rows (n, ROW); they sum to 1.

    Args:
        rows: A prediction's may be a little out of order, or below nothing.
        distance: From the lip to the receiver's axis [m], equally spaced, shape (D,).
        radius: Of the receiver [m].
    """
    retained = np.clip(rows[:, 0], 0.0, 1.0) ** 2
    ahead, across = np.split(rows[:, 1:], 2, axis=1)
    reach = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    caught = _inside(ahead - reach, ahead + reach, distance)
    kept = np.broadcast_to(retained[:, None], caught.shape)
    left = 1.0 - kept
    return np.stack([left * (1.0 - caught), left * caught, kept], axis=-1)


def _inside(low: NDArray, high: NDArray, distance: NDArray) -> NDArray[np.float64]:
    """Share (n, D) of the intervals (n, PARCELS) that hold each distance."""
    n, last = len(low), len(distance)
    first = np.searchsorted(distance, low, side="right")
    end = np.maximum(np.searchsorted(distance, high, side="left"), first)
    row = np.arange(n)[:, None] * (last + 1)
    size = n * (last + 1)
    begun, ended = (np.bincount((row + at).ravel(), minlength=size) for at in (first, end))
    return np.cumsum((begun - ended).reshape(n, last + 1), axis=1)[:, :last] / PARCELS
