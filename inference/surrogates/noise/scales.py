"""Scales on which outputs are emulated: there, noise is the same everywhere."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..given_noise import GivenNoise
from ..output_vectors import Output
from .by_mean import ByMean
from .run_size import EQUAL_RUNS_TOLERANCE

NEEDED_NATS = 6.0  # log likelihood that noise which grows with the mean must gain
ANSCOMBE = 3.0 / 8.0  # of a count, added before its root is taken (Anscombe 1948)


def roots(values: np.ndarray) -> np.ndarray:
    return 2.0 * np.sqrt(np.maximum(values, 0.0))


def squares(features: np.ndarray) -> np.ndarray:
    return 0.25 * np.maximum(features, 0.0) ** 2


@dataclass(frozen=True)
class Stretch:
    """Makes noise even whose variance is in proportion to a power of the mean (Bartlett 1947)."""

    power: int
    of: Callable[[np.ndarray], np.ndarray]
    back: Callable[[np.ndarray], np.ndarray]


STRETCHES = Stretch(1, roots, squares), Stretch(2, np.log, np.exp)


@dataclass(frozen=True, eq=False)
class Plain:
    """Values as they are, or stretched, with noise that does not depend on them.

    Attributes:
        observed: [m]
        given: The measurement noise; it is zero or unknown where values are stretched.
        stretch: None for none.
        offset: Added before [m].
        unit: Sd of the noise of each feature [m], where it is known to be the same for all runs:
            of stretched values.
    """

    observed: np.ndarray
    given: GivenNoise | None
    stretch: Stretch | None = None
    offset: np.ndarray | float = 0.0
    unit: np.ndarray | None = None

    rounds: ClassVar[int] = 1  # how often `seen` must be asked until it stays the same

    def seen(self, at: np.ndarray | None) -> tuple[np.ndarray, GivenNoise | None]:
        """The observed features [m] and their measurement noise, None where it is unknown.

        Args:
            at: Features around which this must be right [m]; None if they are not known yet.
        """
        return self.of(self.observed), self.given

    def of(self, values: np.ndarray) -> np.ndarray:
        """Values [n, m] as features [n, m]."""
        return values if self.stretch is None else self.stretch.of(values + self.offset)

    def back(self, features: np.ndarray) -> np.ndarray:
        return features if self.stretch is None else self.stretch.back(features) - self.offset

    def sds(self, values: np.ndarray) -> np.ndarray:
        """Sd of the known measurement noise of mean values, in their units [n, m]."""
        return np.zeros_like(values) + (0.0 if self.given is None else np.sqrt(self.given.variance))

    def observe(self, rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
        """Known measurement noise added to mean values [n, m]."""
        return values if self.given is None else values + self.given.draw(rng, len(values))

    def check(self, values: np.ndarray) -> None:
        """Raise ValueError if mean values [..., m] have no measurement noise of this kind."""

    def fitting(self, u: np.ndarray, values: np.ndarray, channel: np.ndarray) -> "Plain":
        """The scale on which run-to-run noise does not grow with the mean, as far as repeated runs
        show that it does.

        The difference of two runs at equal parameters is noise alone. Its variance may be in
        proportion to a power of the mean, with a factor of its own for each pair and channel, so
        that what a pair's parameters do to it does not count.

        Args:
            u: Prior quantiles [n, d].
            values: [n, m], the means of which show it.
            channel: Of each value [m].
        """
        if self.given is not None and self.given.variance.any():
            return self  # on another scale that noise would depend on the mean
        least = min(values.min(), self.observed.min())
        if least < 0.0:
            return self
        first, second = repeated(u)
        if not len(first):
            return self
        difference = np.square(values[first] - values[second]) / 2.0
        mean = (values[first] + values[second]) / 2.0
        differ = difference > (EQUAL_RUNS_TOLERANCE * values.std(0)) ** 2
        if not differ.any():
            return self
        kinds = [one for one in STRETCHES if one.power < 2 or least > 0.0]
        gains = [_gain(difference, mean, channel, one.power) for one in kinds]
        if max(gains) < NEEDED_NATS:
            return self
        best = kinds[int(np.argmax(gains))]
        total = np.bincount(channel, (mean**best.power).sum(0))
        unit = (np.bincount(channel, difference.sum(0)) / np.where(total > 0.0, total, 1.0))[
            channel
        ]
        offset = ANSCOMBE * unit if best.power == 1 else 0.0
        noise = np.sqrt(np.where(unit > 0.0, unit, 1.0))
        return replace(self, stretch=best, offset=offset, unit=noise)


OutputScale = Plain | ByMean


def comparable(scale: OutputScale, output: Output) -> Callable[[np.ndarray], np.ndarray]:
    """Scales of features: features [n, m] -> [m]."""
    unit = scale.unit
    return output.scale if unit is None else lambda _: unit


def in_units(scale: OutputScale, features: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """An sd of features [n, m] as one of their values, in the values' units."""
    if isinstance(scale, Plain) and scale.stretch is None:
        return sd
    return 0.5 * (scale.back(features + sd) - scale.back(features - sd))


def repeated(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of runs at equal u [n, d], and of the run before each."""
    _, which = np.unique(u, axis=0, return_inverse=True)
    order = np.argsort(which.ravel(), kind="stable")
    same = np.flatnonzero(np.diff(which.ravel()[order]) == 0)
    return order[same], order[same + 1]


def _gain(squared: np.ndarray, mean: np.ndarray, channel: np.ndarray, power: int) -> float:
    """Log likelihood of Gaussian differences that a variance in proportion to mean^power gains
    over a constant one, each pair and channel having its own factor.

    Args:
        squared: Half the squared differences [p, m].
        mean: [p, m]; where both runs are at its least or its largest, they were cut off there (a
            count of 0, a sensor's limit), and nothing is concluded.
        channel: [m]
    """
    total = 0.0
    for one in np.unique(channel):
        means = mean[:, channel == one]
        ends = (means == means.min()) | (means == means.max())
        within = ~ends | (squared[:, channel == one] > 0.0)
        for near, at, free in zip(squared[:, channel == one], means, within, strict=True):
            near, at = near[free], at[free] ** power
            if len(near) > 1 and near.any():
                even = np.log(near.mean())
                total += 0.5 * np.sum(even - np.log(np.mean(near / at)) - np.log(at))
    return total
