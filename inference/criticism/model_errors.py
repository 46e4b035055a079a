"""A simulator's model error: its own residual, of known size or learned from clean data."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, solve

from .._float64 import in_float64
from .._lazy import stats
from ..arguments import check_flag, check_kind, checked_array, checked_number
from ..surrogates.measurement_noise import Layout
from .measurement_noise import Noise, SumOfNoises, check_noise, gaussian, samples, stationary

REPEATED = 0.85
"""Correlation of a simulator's errors in two repetitions of one experiment. Of the stirs of the
application, filled and tilted a little differently: 0.95 in a damped system, 0.8 in one that hits
walls."""

MIN_CORRELATION = 0.1  # below it a repetition says nothing of where the simulator errs
MIN_WEIGHT = 1e-6  # so that a mean over clean data is one
MIN_OTHERS = 0.5  # weight of the other clean data by which one of them can be judged
MIN_FREEDOM = 3  # with fewer, draws have no variance and no effect would be found
SIZE_TAIL = 1e-3  # probability of a size beyond those that are averaged over, on either side
JITTER = 1e-9  # of the largest variance, so that covariances can be inverted
LAST_LAG = 12.0  # correlation times after which errors count as independent
KNOWN_FREEDOM = 30.0  # of a size that is given: known within some 13 %


@dataclass(frozen=True, eq=False)
class CleanData:
    """Data in which no effect is believed to be missing.

    Attributes:
        residual: Less the calibrated simulator's mean [T, channels], samples equally far apart;
            NaN where missing.
        noise: Of its measurement, which is not the simulator's fault.
        same: Whether it repeats the experiment that is looked at, sample by sample.
        regime_distance: Of its regime from that of the data that are looked at, along an axis on
            which a simulator's errors change over a distance of 1.

    Raises:
        ValueError: `residual` is no [T, channels], infinite somewhere or nowhere finite, or another
            field is not as above.
    """

    residual: np.ndarray
    noise: Noise
    same: bool = True
    regime_distance: float = 0.0

    def __post_init__(self) -> None:
        residual = checked_array("residual", self.residual)
        if residual.ndim != 2 or np.isinf(residual).any() or not np.isfinite(residual).any():
            raise ValueError(
                "residual must have the shape [T, channels] (one channel: [:, None]), be finite "
                "somewhere and infinite nowhere (NaN is a missing sample), got "
                f"{self.residual!r:.100}"
            )
        check_noise("noise", self.noise)
        check_flag("same", self.same)
        distance = checked_number("regime_distance", self.regime_distance, math.isfinite, "finite")
        object.__setattr__(self, "residual", residual)
        object.__setattr__(self, "regime_distance", distance)

    @property
    def correlation(self) -> float:
        """Correlation of the simulator's error on it with that on the data that are looked at."""
        return REPEATED * float(_likeness(self.regime_distance)) * self.same

    def values(self, at: Layout) -> np.ndarray:
        """The residual at n samples [n]; a missing one is zero."""
        return np.nan_to_num(self.residual[at.sample, at.channel])


@dataclass(frozen=True, eq=False)
class ModelError:
    """A simulator's own residual, as a Gaussian process of uncertain size.

    Over time it is stationary, of the clean data's mean autocovariance. Over regimes its
    correlation falls like a Gaussian. So clean data of the same experiment in a near regime tell
    where the simulator errs: given them, the residual has a mean, and less variance (kriging;
    Kennedy and O'Hagan 2001 model a simulator's discrepancy so, Brynjarsdottir and O'Hagan 2014
    say why its shape matters).

    Attributes:
        autocovariance: Of clean residuals by lag in samples, shape [lags]; zero beyond.
        freedom: Of the size: it is known as well as a variance from so many numbers, but never less
            than from MIN_FREEDOM.
        clean: What it was learned from.
        known: What was known of it without them, if anything.
    """

    autocovariance: np.ndarray
    freedom: float
    clean: tuple[CleanData, ...] = ()
    known: "ModelError | None" = None

    def mean(self, at: Layout) -> np.ndarray:
        """Expected residual of the simulator [n]."""
        return self._given(at)[0]

    def covariance(self, at: Layout) -> np.ndarray:
        """Covariance of the residual about that mean [n, n]."""
        return self._given(at)[1]

    def draw(self, rng: np.random.Generator, at: Layout, count: int) -> np.ndarray:
        """Draws [count, n] about that mean, each of a size that it may have."""
        drawn = gaussian(rng, self.covariance(at), count)
        return np.sqrt(self._size.rvs(count, random_state=rng))[:, None] * drawn

    def sizes(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Variances that it may have, in units of `covariance`, and their log weights.

        Even in the logarithm, [count] each. That all of the covariance is of one size is right
        where the clean data's own noise is small.
        """
        least, most = self._size.ppf([SIZE_TAIL, 1.0 - SIZE_TAIL])
        sizes = np.geomspace(least, most, count)
        return sizes, self._size.logpdf(sizes) + np.log(sizes)

    @property
    def _size(self) -> Any:
        freedom = max(self.freedom, MIN_FREEDOM)
        return stats.invgamma(freedom / 2.0, scale=freedom / 2.0)

    def leave_one_out(self) -> "Iterator[tuple[CleanData, float, ModelError]]":
        """Each repetition of the experiment, its weight, and the model error that the others teach.

        Those are left out of whose regime the others tell next to nothing.
        """
        weights = _weights(self.clean, self.known)
        for k, (one, weight) in enumerate(zip(self.clean, weights, strict=True)):
            others = [
                replace(other, regime_distance=other.regime_distance - one.regime_distance)
                for other in self.clean[:k] + self.clean[k + 1 :]
            ]
            if one.same and sum(_likeness(other.regime_distance) for other in others) >= MIN_OTHERS:
                yield one, float(weight), learned_model_error(others, self.known)

    def _given(self, at: Layout) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance given the repetitions."""
        return _conditional(self, *(np.asarray(part, int).tobytes() for part in at))

    def _over(self, layouts: Sequence[Layout]) -> np.ndarray:
        """The autocovariance at all lags that are needed."""
        longest = 1 + max(int(at.sample.max()) for at in layouts)
        missing = max(longest - len(self.autocovariance), 0)
        # over more samples than it was learned from, it must be made positive anew
        return positive_autocovariance(np.append(self.autocovariance, np.zeros(missing)))


@lru_cache(maxsize=16)  # of each regime: the data, those held out, and one that is left out
@in_float64
def _conditional(error: ModelError, channel: bytes, sample: bytes) -> tuple[np.ndarray, np.ndarray]:
    """A Gaussian's conditional, kept: all hypotheses of an experiment ask for the same."""
    at = Layout(np.frombuffer(channel, int), np.frombuffer(sample, int))
    known = [
        (one, there)
        for one in error.clean
        if one.correlation > MIN_CORRELATION and len((there := samples(one.residual)).sample)
    ]
    by_lag = error._over([at, *(there for _, there in known)])
    mean, covariance = np.zeros(len(at.sample)), stationary(by_lag, at, at)
    if known and by_lag.any():
        across = np.vstack(
            [one.correlation * stationary(by_lag, there, at) for one, there in known]
        )
        errors = np.block(
            [
                [
                    _correlation(one, other) * stationary(by_lag, there, where)
                    for other, where in known
                ]
                for one, there in known
            ]
        )
        measured = np.asarray(block_diag(*(one.noise.covariance(there) for one, there in known)))
        joint = errors + measured
        joint += JITTER * joint.max() * np.eye(len(joint))
        seen = np.concatenate([one.values(there) for one, there in known])
        weight = solve(joint, across, assume_a="pos")
        mean, covariance = weight.T @ seen, covariance - across.T @ weight
    for part in (mean, covariance):
        part.flags.writeable = False  # all who ask get the same
    return mean, covariance


def _likeness(regime_distance: np.ndarray | float) -> np.ndarray:
    """Correlation of a simulator's errors in two regimes, from 0 to 1."""
    return np.exp(-0.5 * np.square(regime_distance))


def _correlation(one: CleanData, other: CleanData) -> float:
    """Correlation of the simulator's errors on two repetitions."""
    apart = one.regime_distance - other.regime_distance
    return 1.0 if one is other else REPEATED * float(_likeness(apart))


def learned_model_error(clean: Sequence[CleanData], known: ModelError | None = None) -> ModelError:
    """Learn a simulator's model error from clean data.

    A simulator may err by much in one regime and by nothing in another: what is learned of sizes is
    learned from the nearest. Where its errors are known to differ between regimes, give each
    residual and its noise times the error known here over the one known there.

    Sums of squares of both sources are pooled: their size has the inverse-gamma distribution of
    all numbers. Where their variances differ by more than their freedoms allow, the pooled freedom
    is divided by Birge's ratio, the square of that difference over its expectation (Birge 1932).

    Args:
        clean: In which no effect is believed to be missing.
        known: What is known of the error without them, see `model_error`: it counts as clean data
            of this very regime, `known.freedom` of them. It has no clean data of its own.

    Raises:
        ValueError: there are none and nothing is known, `known` was learned from clean data, they
            differ in their number of channels, or those of the same experiment in their shape.
    """
    for one in clean:
        check_kind("each of clean", one, CleanData)
    check_kind("known", known, ModelError | None)
    if known is not None and known.clean:
        raise ValueError(
            "known must come from `model_error`, got one that was learned from clean data; "
            "give these in clean instead"
        )
    if known is not None and not clean:
        return known
    shapes = [one.residual.shape for one in clean]
    repeated = {one.residual.shape for one in clean if one.same}
    if len({channels for _, channels in shapes}) != 1 or len(repeated) > 1:
        raise ValueError(
            "clean must hold at least one data set, all of as many channels, and repetitions of "
            f"one experiment of one shape, got the shapes {shapes}"
        )
    before = np.zeros(0) if known is None else known.autocovariance
    lags = max(len(before), *(len(one.residual) for one in clean))
    each = [
        _autocovariance(one.residual, lags) - _expected_of(one.noise, len(one.residual), lags)
        for one in clean
    ]
    weights = _weights(clean, known)
    mean, freedom = np.average(each, axis=0, weights=weights), float(np.sum(weights))
    if known is not None:
        prior = np.pad(before, (0, lags - len(before)))
        mean, freedom = _pooled(prior, known.freedom, mean, freedom)
    return ModelError(positive_autocovariance(mean), freedom, tuple(clean), known)


def _pooled(
    one: np.ndarray, freedom: float, other: np.ndarray, other_freedom: float
) -> tuple[np.ndarray, float]:
    """Autocovariance [lags] of two sources, and its freedom."""
    both = freedom + other_freedom
    mean = (freedom * one + other_freedom * other) / both
    if not mean[0] > 0.0:
        return mean, both
    # a variance v of n numbers has the variance 2 v^2 / n
    expected = 2.0 * mean[0] ** 2 * (1.0 / freedom + 1.0 / other_freedom)
    return mean, both / max((one[0] - other[0]) ** 2 / expected, 1.0)


def model_error(size: float, correlation: ArrayLike, freedom: float = KNOWN_FREEDOM) -> ModelError:
    """A model error of known size and correlation, without clean data to learn it from.

    Like any noise it goes into `Experiment`, and into `fit` as `noise=`, beside that of the
    measurement: `SumOfNoises((KnownNoise(0.1), model_error(0.3, 6.0)))`. Errors that change as the
    output does when a parameter changes look like another value of it: they widen the posterior
    most (Brynjarsdottir and O'Hagan 2014).

    Args:
        size: Sd, in the output's unit, not negative.
        correlation: Over time, in each channel: the time t over which errors are forgotten, in
            samples, as exp(-lag / t); or the correlation by lag [lags] from 1 on, 0 beyond, such
            as `rhythm(observed)`. One that no process has becomes the nearest that one has.
        freedom: The size is known as well as a variance from so many numbers.

    Raises:
        ValueError: an argument is not as above.
    """
    checked_number("size", size, lambda sd: 0.0 <= sd < np.inf, "finite and not negative")
    checked_number("freedom", freedom, lambda n: 0.0 < n < np.inf, "finite and positive")
    given = checked_array("correlation", correlation)
    if given.ndim == 0 and 0.0 < given < np.inf:
        by_lag = np.exp(-np.arange(int(np.ceil(LAST_LAG * given)) + 1) / given)
    elif given.ndim == 1 and given.size and given[0] == 1.0 and (np.abs(given) <= 1.0).all():
        by_lag = given
    else:
        raise ValueError(
            "correlation must be a positive number of samples, or correlations by lag [lags] of "
            f"which the first is 1, got {correlation!r:.100}"
        )
    return ModelError(size**2 * positive_autocovariance(by_lag), freedom)


def rhythm(observed: ArrayLike) -> np.ndarray:
    """Autocorrelation by lag [T] of a series [T, ...], its channels' means taken off.

    Where a simulator answers a periodic drive a little too much, or too late, it errs in the
    rhythm of what is observed. NaN is a missing sample; where nothing varies, errors are
    independent.
    """
    series = checked_array("observed", observed)
    columns = series.reshape(len(series), -1)
    seen = np.maximum(np.isfinite(columns).sum(0), 1)
    found = _autocovariance(columns - np.nansum(columns, 0) / seen, len(columns))
    return found / found[0] if found[0] > 0.0 else np.ones(1)


def _weights(clean: Sequence[CleanData], known: ModelError | None) -> np.ndarray:
    """Weights by the distance of regimes; the nearest has weight 1 where nothing else is known."""
    square = np.array([one.regime_distance**2 for one in clean])
    least = 0.0 if known is not None else np.min(square, initial=np.inf)
    return np.maximum(np.exp(-0.5 * (square - least)), MIN_WEIGHT)


def split_noise(noise: Noise) -> tuple[Noise, ModelError | None]:
    """The measurement's noise, and the model error that was added to it."""
    parts = noise.parts if isinstance(noise, SumOfNoises) else ()
    errors = [part for part in parts if isinstance(part, ModelError)]
    if not errors:
        return noise, None
    measured = tuple(part for part in parts if not isinstance(part, ModelError))
    return SumOfNoises(measured), errors[0]


def _autocovariance(residual: np.ndarray, lags: int) -> np.ndarray:
    """Biased estimate by lag, averaged over channels: it makes no negative variance."""
    filled = np.nan_to_num(residual)
    seen = max(int(np.isfinite(residual).sum()), 1)
    found = np.zeros(lags)
    for lag in range(len(filled)):
        found[lag] = np.sum(filled[lag:] * filled[: len(filled) - lag]) / seen
    return found


def _expected_of(noise: Noise, samples: int, lags: int) -> np.ndarray:
    """Expectation of `_autocovariance` for so many samples of noise alone."""
    at = Layout(np.zeros(samples, int), np.arange(samples))
    found = np.zeros(lags)
    found[:samples] = noise.covariance(at)[0] * (1.0 - np.arange(samples) / samples)
    return found


def positive_autocovariance(autocovariance: np.ndarray) -> np.ndarray:
    """The nearest autocovariance whose spectrum is not negative."""
    even = np.concatenate([autocovariance, autocovariance[:0:-1]])
    spectrum = np.maximum(np.fft.rfft(even).real, 0.0)
    return np.fft.irfft(spectrum, len(even))[: len(autocovariance)]
