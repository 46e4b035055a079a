"""Scales on which run-to-run noise is even that grows with the mean, as repeated runs show it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..emulator import EQUAL_RUNS_TOLERANCE, repeated
from ..output_vectors import Output
from .by_mean import Plain
from .given import GivenNoise

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
class Stretched(Plain):
    """Values stretched, without known measurement noise. Its methods are those of `Plain`.

    Attributes:
        stretch: Root or logarithm.
        offset: Added before [m].
        sd: Of the noise of each feature [m].
    """

    stretch: Stretch
    offset: np.ndarray | float
    sd: np.ndarray

    def seen(self, at: np.ndarray | None) -> tuple[np.ndarray, GivenNoise | None]:
        return self.of(self.observed), self.given

    def log_levels(self, at: np.ndarray, seen: tuple[np.ndarray, GivenNoise | None]) -> np.ndarray:
        # the slope of the root, or of the logarithm
        return -0.5 * self.stretch.power * np.log(self.observed + self.offset)

    def of(self, values: np.ndarray) -> np.ndarray:
        return self.stretch.of(values + self.offset)

    def back(self, features: np.ndarray) -> np.ndarray:
        return self.stretch.back(features) - self.offset

    def in_units(self, features: np.ndarray, sd: np.ndarray) -> np.ndarray:
        return 0.5 * (self.back(features + sd) - self.back(features - sd))

    def unit(self, output: Output) -> Callable[[np.ndarray], np.ndarray]:
        return lambda features: self.sd


def stretched(plain: Plain, u: np.ndarray, values: np.ndarray, channel: np.ndarray) -> Plain:
    """The scale on which run-to-run noise does not grow with the mean, as far as repeated runs
    show that it does.

    The difference of two runs at equal parameters is noise alone. Its variance may be in
    proportion to a power of the mean, with a factor of its own for each pair and channel, so
    that what a pair's parameters do to it does not count.

    Args:
        plain: The values as they are; where noise is given, they stay so, since on another scale
            it would depend on the mean.
        u: Prior quantiles [n, d].
        values: [n, m], the means of which show it.
        channel: Of each value [m].
    """
    least = min(values.min(), plain.observed.min())
    given = plain.given is not None and plain.given.variance.any()
    first, second = repeated(u)
    if given or least < 0.0 or not len(first):
        return plain
    difference = np.square(values[first] - values[second]) / 2.0
    mean = (values[first] + values[second]) / 2.0
    if not (difference > (EQUAL_RUNS_TOLERANCE * values.std(0)) ** 2).any():
        return plain
    kinds = [one for one in STRETCHES if one.power < 2 or least > 0.0]
    gains = [_gain(difference, mean, channel, one.power) for one in kinds]
    if max(gains) < NEEDED_NATS:
        return plain
    best = kinds[int(np.argmax(gains))]
    total = np.bincount(channel, (mean**best.power).sum(0))
    unit = (np.bincount(channel, difference.sum(0)) / np.where(total > 0.0, total, 1.0))[channel]
    offset = ANSCOMBE * unit if best.power == 1 else 0.0
    sd = np.sqrt(np.where(unit > 0.0, unit, 1.0))
    return Stretched(plain.observed, plain.given, best, offset, sd)


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
