"""Noise whose size follows from the simulated mean, and the scale on which it is even."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, cast

import numpy as np
from scipy.special import gammaln, xlogy

from ...arguments import checked_array, checked_number
from ..output_vectors import Output
from .given import GivenNoise

DECADES = np.linspace(-25.0, 25.0, 1001)  # logs of the means, over the largest observed one
LEAST_STEP = 1e-12  # of the scale, from one of them to the next
TRUSTED = 3.0  # sds from an observed value, up to which its likelihood is looked at
HALF_STEP = 0.5  # sds, over which its slope and curvature are taken
LEAST_CURVATURE = 0.1  # where it is not convex, as far from an observed value
ROUNDING = 1e-9  # relative: a mean that is negative by less counts as 0
LARGEST_COUNT = 1e18  # that NumPy draws
LEFT_OF_NOISE = 0.02  # of the variance of noise by the mean, that components may leave

SdOfMean = Callable[[np.ndarray], np.ndarray]


class Poisson:
    """Counts; each value is the average of `counts` [m] samples. `log_density` lacks
    `log_constant`."""

    def check(self, values: np.ndarray) -> None:
        least = values.min()
        if least < -ROUNDING * np.abs(values).max():
            raise ValueError(f'noise="poisson" needs means that are not negative, got {least:.4g}')

    def sd(self, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        return np.sqrt(np.maximum(mean, 0.0) / counts)

    def log_density(self, value: np.ndarray, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        mean = np.maximum(mean, 0.0)
        return counts * (xlogy(value, mean) - mean)

    def log_constant(self, value: np.ndarray, counts: np.ndarray) -> np.ndarray:
        return xlogy(counts * value, counts) - gammaln(counts * value + 1.0)

    def draw(self, rng: np.random.Generator, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        return rng.poisson(np.clip(counts * mean, 0.0, LARGEST_COUNT)) / counts


@dataclass(frozen=True)
class Gaussian:
    """Independent Gaussian noise; each value is the average of `counts` [m] samples. `log_density`
    lacks `log_constant`.

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

    def log_constant(self, value: np.ndarray, counts: np.ndarray) -> np.ndarray:
        return np.full(len(value), -0.5 * np.log(2.0 * np.pi))

    def draw(self, rng: np.random.Generator, mean: np.ndarray, counts: np.ndarray) -> np.ndarray:
        sd = self.sd(mean, counts)
        return mean + np.where(np.isfinite(sd), sd, 0.0) * rng.normal(size=mean.shape)


Law = Poisson | Gaussian


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
            raise ValueError(
                'noise must be a number, an array, a function of the mean or "poisson", got '
                f"{noise!r:.100}"
            )
        return Poisson()
    return Gaussian(cast(SdOfMean, noise)) if callable(noise) else None


@dataclass(frozen=True, eq=False)
class Plain:
    """Values as they are, with noise that does not depend on them.

    Attributes:
        observed: [m]
        given: The measurement noise; None where it is unknown.
    """

    observed: np.ndarray
    given: GivenNoise | None

    rounds: ClassVar[int] = 1  # how often `seen` must be asked until it stays the same
    left: ClassVar[float] = np.inf  # see `EmulatorLimits.left`

    def seen(self, at: np.ndarray | None) -> tuple[np.ndarray, GivenNoise | None]:
        """The observed features [m] and their measurement noise, None where it is unknown.

        Args:
            at: Features around which this must be right [m]; None if they are not known yet.
        """
        return self.observed, self.given

    def log_levels(self, at: np.ndarray, seen: tuple[np.ndarray, GivenNoise | None]) -> np.ndarray:
        """Log density of each observed value, less that of its feature in Gaussian noise [m].

        Args:
            at: The features' means, around which this must be right [m].
            seen: As `seen` has returned it.
        """
        return np.zeros(len(self.observed))

    def of(self, values: np.ndarray) -> np.ndarray:
        """Values [n, m] as features [n, m]."""
        return values

    def back(self, features: np.ndarray) -> np.ndarray:
        return features

    def in_units(self, features: np.ndarray, sd: np.ndarray) -> np.ndarray:
        """An sd of features [n, m] as one of their values, in the values' units."""
        return sd

    def unit(self, output: Output) -> Callable[[np.ndarray], np.ndarray]:
        """Scales that make features comparable: features [n, m] -> [m]."""
        return output.scale

    def sds(self, values: np.ndarray) -> np.ndarray:
        """Sd of the known measurement noise of mean values, in their units [n, m]."""
        return np.zeros_like(values) + (0.0 if self.given is None else np.sqrt(self.given.variance))

    def observe(self, rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
        """Known measurement noise added to mean values [n, m]."""
        return values if self.given is None else values + self.given.draw(rng, len(values))

    def check(self, values: np.ndarray) -> None:
        """Raise ValueError if mean values [..., m] have no measurement noise of this kind."""


@dataclass(frozen=True, eq=False)
class ByMean:
    """Means on a scale on which their noise has sd 1: the integral of 1 / sd (Bartlett 1947).

    There, the likelihood of each observed value is nearly Gaussian. `seen` is the Gaussian that has
    its slope and curvature at given means: iterated with the means that fit best, the posterior has
    the mode and the width of the exact one (Fisher's scoring; McCullagh and Nelder 1989, section
    2.5). Its methods are those of `Plain`, which documents them.

    Attributes:
        law: Of the noise.
        observed: [m]
        counts: Samples averaged for each value [m].
    """

    law: Law
    observed: np.ndarray
    counts: np.ndarray

    rounds: ClassVar[int] = 3
    left: ClassVar[float] = LEFT_OF_NOISE

    def __post_init__(self) -> None:
        self.law.check(self.observed)

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """Means from small to large, close together at 0, and the integral up to them."""
        size = np.abs(self.observed).max() or 1.0
        above = size * np.exp(DECADES)
        means = np.concatenate([-above[::-1], [0.0], above])
        sd = self.law.sd(means, np.ones(len(means)))
        fine = np.isfinite(sd) & (sd > 0.0)
        rate = np.where(fine, 1.0 / np.where(fine, sd, 1.0), 0.0)
        # every step rises, lest the scale could not be inverted
        steps = np.maximum(0.5 * (rate[1:] + rate[:-1]) * np.diff(means), LEAST_STEP)
        integral = np.append(0.0, np.cumsum(steps))
        return means, integral - integral[len(above)]

    def of(self, values: np.ndarray) -> np.ndarray:
        return np.sqrt(self.counts) * np.interp(values, *self._table)

    def back(self, features: np.ndarray) -> np.ndarray:
        means, integral = self._table
        return np.interp(features / np.sqrt(self.counts), integral, means)

    def seen(self, at: np.ndarray | None) -> tuple[np.ndarray, GivenNoise]:
        own = self.of(self.observed)
        near = own if at is None else np.clip(at, own - TRUSTED, own + TRUSTED)
        densities = self._around(near)
        # means at which what was observed is impossible: the observed value's own are not
        near = np.where(np.isfinite(densities).all(0), near, own)
        less, here, more = np.nan_to_num(self._around(near), posinf=0.0, neginf=0.0)
        slope = (more - less) / (2.0 * HALF_STEP)
        curvature = np.maximum((2.0 * here - more - less) / HALF_STEP**2, LEAST_CURVATURE)
        given = GivenNoise(1.0 / curvature, np.zeros((len(own), 0)))
        return near + slope / curvature, given

    def log_levels(self, at: np.ndarray, seen: tuple[np.ndarray, GivenNoise | None]) -> np.ndarray:
        features, noise = seen
        variance = 1.0 if noise is None else noise.variance
        density = self.law.log_density(self.observed, self.back(at), self.counts)
        gaussian = -0.5 * (np.log(2.0 * np.pi * variance) + (features - at) ** 2 / variance)
        return density + self.law.log_constant(self.observed, self.counts) - gaussian

    def _around(self, near: np.ndarray) -> np.ndarray:
        """Log densities of the observed values half a step below `near`, there and above [3, m]."""
        steps = -HALF_STEP, 0.0, HALF_STEP
        means = (self.back(near + step) for step in steps)
        return np.stack([self.law.log_density(self.observed, mean, self.counts) for mean in means])

    def in_units(self, features: np.ndarray, sd: np.ndarray) -> np.ndarray:
        return 0.5 * (self.back(features + sd) - self.back(features - sd))

    def unit(self, output: Output) -> Callable[[np.ndarray], np.ndarray]:
        return lambda features: np.ones(features.shape[1])

    def sds(self, values: np.ndarray) -> np.ndarray:
        return self.law.sd(values, self.counts)

    def observe(self, rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
        return self.law.draw(rng, values, self.counts)

    def check(self, values: np.ndarray) -> None:
        self.law.check(values)


OutputScale = Plain | ByMean
"""Scales on which outputs are emulated."""
