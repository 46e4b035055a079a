"""Measurement noise whose size follows from the simulated mean."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from scipy.special import xlogy

from ..arguments import checked_array, checked_number
from ..surrogates.given_noise import GivenNoise

EXACT_TO = 3.0  # root of the deviance of one value up to which it is exact
LARGEST_DEVIANCE = 1e12
REACH, STEPS, ZOOMS = 5.0, 201, 4  # of the search for the mean that fits a value best
TABLE = np.linspace(-20.0, 20.0, 401)  # logs of distances and ratios at which the scale is inverted
ROUNDING = 1e-9  # relative: a mean that is negative by less counts as 0
LARGEST_COUNT = 1e18  # that NumPy draws

SdOfMean = Callable[[np.ndarray], np.ndarray]


class Law(Protocol):
    """How values scatter around their mean; `counts` [m] samples were averaged for each."""

    def check(self, values: np.ndarray) -> None: ...

    def sd(self, mean: np.ndarray, counts: np.ndarray) -> np.ndarray: ...

    def log_density(
        self, value: np.ndarray, mean: np.ndarray, counts: np.ndarray
    ) -> np.ndarray: ...

    def draw(
        self, rng: np.random.Generator, mean: np.ndarray, counts: np.ndarray
    ) -> np.ndarray: ...


class Poisson:
    """Counts."""

    def check(self, values: np.ndarray) -> None:
        least = values.min()
        if least < -ROUNDING * np.abs(values).max():
            raise ValueError(f'noise="poisson" needs means that are not negative, got {least:.4g}')

    def sd(self, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        return np.sqrt(np.maximum(mean, 0.0) / counts)

    def log_density(self, value: np.ndarray, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        mean = np.maximum(mean, 0.0)
        return counts * (xlogy(value, mean) - mean)

    def draw(self, rng: np.random.Generator, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        return rng.poisson(np.clip(counts * mean, 0.0, LARGEST_COUNT)) / counts


@dataclass(frozen=True)
class Gaussian:
    """Independent Gaussian noise.

    Attributes:
        sd_of: Its sd, from means to sds of the same shape, value by value.
    """

    sd_of: SdOfMean

    def check(self, values: np.ndarray) -> None:
        sds = self._sds(values)
        wrong = ~(np.isfinite(sds) & (sds > 0.0))
        if wrong.any():
            raise ValueError(
                f"noise must give a positive, finite sd for each mean, got {sds[wrong][0]:.4g} for "
                f"the mean {values[wrong][0]:.4g}: add what noise is left there, as in "
                "lambda mean: 0.1 + 0.2 * np.abs(mean), or leave the value out (NaN in observed)"
            )

    def _sds(self, mean: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):  # a search may try what no run gives
            found = checked_array("what noise returns", self.sd_of(mean.ravel()))
        if found.size not in (1, mean.size):
            raise ValueError(
                f"noise must give one sd for each of {mean.size} means, got shape {found.shape}"
            )
        return np.broadcast_to(found.ravel(), mean.size).reshape(mean.shape)

    def sd(self, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        return self._sds(mean) / np.sqrt(counts)

    def log_density(self, value: np.ndarray, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        sd = self.sd(mean, counts)
        fine = np.isfinite(sd) & (sd > 0.0)
        sd = np.where(fine, sd, 1.0)
        return np.where(fine, -np.log(sd) - 0.5 * ((value - mean) / sd) ** 2, -np.inf)

    def draw(self, rng: np.random.Generator, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        sd = self.sd(mean, counts)
        return mean + np.where(np.isfinite(sd), sd, 0.0) * rng.normal(size=mean.shape)


@dataclass(frozen=True)
class Share:
    """Sd in proportion to the mean."""

    share: float

    def __call__(self, mean: np.ndarray) -> np.ndarray:
        return self.share * np.abs(mean)


def relative(share: float) -> SdOfMean:
    """Noise in proportion to the simulated mean, for `noise=`: `relative(0.2)` is an sd of 20 %.

    Raises:
        ValueError: `share` is not positive.
    """
    return Share(checked_number("share", share, lambda s: 0.0 < s < np.inf, "positive"))


def law_of(noise: object) -> Law | None:
    """The law that `noise=` names; None where it is a number or an array.

    Raises:
        ValueError: text other than "poisson".
    """
    if isinstance(noise, str):
        if noise != "poisson":
            raise ValueError(f'noise must be "poisson", a function or numbers, got {noise!r:.100}')
        return Poisson()
    return Gaussian(noise) if callable(noise) else None


class Line(NamedTuple):
    """How features go on from a mean: over the scale on which noise is even."""

    mean: np.ndarray  # [m]
    even: np.ndarray
    feature: np.ndarray
    rise: np.ndarray

    def at(self, even: np.ndarray) -> np.ndarray:
        return self.feature + self.rise * (even - self.even)


@dataclass(frozen=True, eq=False)
class ByMean:
    """Signed roots of the deviance between observed values and simulated means.

    Half their sum of squares is the log likelihood ratio of the best means and the simulated ones
    (McCullagh and Nelder 1989, section 2.4): features with observed value 0 and Gaussian noise of
    sd 1 have the very likelihood of the law. Beyond EXACT_TO they go on as straight lines over the
    integral of 1 / sd, as a root or a logarithm: smooth, and far enough from 0 to exclude a mean.

    Attributes:
        law: Of the noise.
        observed: [m]
        counts: Samples averaged for each value [m].
    """

    law: Law
    observed: np.ndarray
    counts: np.ndarray

    def __post_init__(self) -> None:
        self.law.check(self.observed)

    @property
    def given(self) -> GivenNoise:
        m = len(self.observed)
        return GivenNoise(np.ones(m), np.zeros((m, 0)))

    @cached_property
    def best(self) -> np.ndarray:
        """The mean of greatest likelihood for each value [m]."""
        width = REACH * self.law.sd(self.observed, self.counts)
        found = self.observed
        for _ in range(ZOOMS):
            tried = found + width * np.linspace(-1.0, 1.0, STEPS)[:, None]
            density = self.law.log_density(self.observed, tried, self.counts)
            found = np.take_along_axis(tried, density.argmax(0)[None], 0)[0]
            width = 2.0 * width / (STEPS - 1)
        return found

    @cached_property
    def _means(self) -> np.ndarray:
        """Means from small to large [p, m], close together at the best one and at 0."""
        size = np.maximum(self.law.sd(self.best, self.counts), np.abs(self.best))
        steps = np.exp(TABLE)[:, None] * np.where(size > 0.0, size, 1.0 / self.counts)
        ends = [self.best - steps, self.best + steps, -steps, steps]
        return np.sort(np.concatenate([*ends, self.best[None]]), axis=0)

    @cached_property
    def _even(self) -> np.ndarray:
        """The scale on which noise is 1 everywhere, the integral of 1 / sd, at `_means` [p, m]."""
        sd = self.law.sd(self._means, self.counts)
        fine = np.isfinite(sd) & (sd > 0.0)
        rate = np.where(fine, 1.0 / np.where(fine, sd, 1.0), 0.0)
        steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(self._means, axis=0)
        return np.concatenate([np.zeros((1, len(self.best))), np.cumsum(steps, axis=0)])

    @cached_property
    def _ends(self) -> tuple[Line, Line]:
        """Where the exact features end below and above the best mean, and how they go on."""
        exact, means = self._exact(self._means), self._means
        within = np.abs(exact) <= EXACT_TO
        at = np.argmin(np.abs(means - self.best), axis=0)
        rows = np.arange(len(means))[:, None]
        low = np.where(within | (rows > at), -1, rows).max(0) + 1
        high = np.where(within | (rows < at), len(rows), rows).min(0) - 1
        low, high = np.minimum(low, at - 1), np.maximum(high, at + 1)
        return self._line(exact, low, 1), self._line(exact, high, -1)

    def _line(self, exact: np.ndarray, row: np.ndarray, inside: int) -> Line:
        column = np.arange(len(row))
        here, next_ = (row, column), (row + inside, column)
        step = self._even[next_] - self._even[here]
        rise = np.where(step > 0.0, (exact[next_] - exact[here]) / np.where(step, step, 1.0), 1.0)
        return Line(self._means[here], self._even[here], exact[here], rise)

    def _exact(self, values: np.ndarray) -> np.ndarray:
        at_best = self.law.log_density(self.observed, self.best, self.counts)
        density = self.law.log_density(self.observed, values, self.counts)
        deviance = np.clip(2.0 * (at_best - density), 0.0, LARGEST_DEVIANCE)
        return np.sign(values - self.best) * np.sqrt(deviance)

    def of(self, values: np.ndarray) -> np.ndarray:
        columns = zip(values.T, self._means.T, self._even.T, strict=True)
        even = np.stack([np.interp(*column) for column in columns], axis=1)
        low, high = self._ends
        found = np.where(values < low.mean, low.at(even), self._exact(values))
        return np.where(values > high.mean, high.at(even), found)

    @cached_property
    def _table(self) -> np.ndarray:
        return np.maximum.accumulate(self.of(self._means))

    def back(self, features: np.ndarray) -> np.ndarray:
        columns = zip(features.T, self._table.T, self._means.T, strict=True)
        return np.stack([np.interp(*column) for column in columns], axis=1)

    @property
    def unit(self) -> np.ndarray:
        return np.ones(len(self.observed))

    def sds(self, values: np.ndarray) -> np.ndarray:
        return self.law.sd(values, self.counts)

    def observe(self, rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
        return self.law.draw(rng, values, self.counts)

    def check(self, values: np.ndarray) -> None:
        self.law.check(values)
