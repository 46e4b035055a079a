"""Noise between a simulator's mean output and the data, besides the simulator's own noise."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from scipy.special import softmax

from .._float64 import in_float64
from ..arguments import checked_array, require
from ..surrogates.measurement_noise import Layout, Nodes, correlated

CORRELATIONS = np.linspace(0.0, 0.97, 40)  # of neighbouring samples
DRAWS = 400
ROUNDING = 1e-12  # of the largest value: what varies less does not vary


@runtime_checkable
class Noise(Protocol):
    """Gaussian noise whose size may be uncertain."""

    def covariance(self, at: Layout) -> np.ndarray:
        """[n, n] of n samples."""
        ...

    def draw(self, rng: np.random.Generator, at: Layout, count: int) -> np.ndarray:
        """[count, n]; each row draws the uncertain noise size anew."""
        ...


def check_noise(name: str, noise: object) -> None:
    """Raise ValueError unless it is a `Noise`."""
    require(isinstance(noise, Noise), name, "be a Noise, such as KnownNoise(0.01)", noise)


@dataclass(frozen=True, eq=False)
class KnownNoise:
    """Independent noise of known size.

    Attributes:
        sd: In the output's unit: a number, or one for each sample.

    Raises:
        ValueError: `sd` is not finite, or negative.
    """

    sd: float | np.ndarray

    def __post_init__(self) -> None:
        sd = checked_array("sd", self.sd)
        fits = np.isfinite(sd).all() and (sd >= 0.0).all()
        require(fits, "sd", "be finite and not negative", self.sd)

    def covariance(self, at: Layout) -> np.ndarray:
        return np.diag(np.broadcast_to(np.asarray(self.sd, float) ** 2, at.channel.shape))

    def draw(self, rng: np.random.Generator, at: Layout, count: int) -> np.ndarray:
        return self.sd * rng.normal(size=(count, len(at.channel)))


@dataclass(frozen=True, eq=False)
class AutoregressiveNoise:
    """AR(1) noise, independent between channels, of uncertain size and correlation.

    Attributes:
        sd: Draws of its size from what is known of it, shape [g].
        correlation: And of the correlation of neighbouring samples, shape [g].
        samples: From how many samples it was learned; 0 where it was given.
    """

    sd: np.ndarray
    correlation: np.ndarray
    samples: int = 0

    def covariance(self, at: Layout) -> np.ndarray:
        lags = np.arange(np.ptp(at.sample) + 1)
        # the mean over the draws: what one sample predicts of another, all in all
        of_lag = np.mean(self.sd[:, None] ** 2 * self.correlation[:, None] ** lags, 0)
        return stationary(of_lag, at, at)

    def draw(self, rng: np.random.Generator, at: Layout, count: int) -> np.ndarray:
        which = rng.integers(len(self.sd), size=count)
        order = np.lexsort((at.sample, at.channel))
        white = rng.normal(size=(count, len(order)))
        sorted_at = Layout(at.channel[order], at.sample[order])
        noise = np.empty_like(white)
        noise[:, order] = correlated(
            white, sorted_at, Nodes(self.sd[which], self.correlation[which])
        )
        return noise


@dataclass(frozen=True)
class SumOfNoises:
    """Independent noises, added up."""

    parts: tuple[Noise, ...]

    def covariance(self, at: Layout) -> np.ndarray:
        return np.sum([part.covariance(at) for part in self.parts], axis=0)

    def draw(self, rng: np.random.Generator, at: Layout, count: int) -> np.ndarray:
        return np.sum([part.draw(rng, at, count) for part in self.parts], axis=0)


def samples(observed: np.ndarray) -> Layout:
    """Channel and sample of each finite value, in the flattened order."""
    at = np.flatnonzero(np.isfinite(observed))
    channels = int(np.prod(observed.shape[1:]))
    return Layout(at % channels, at // channels)


def stationary(by_lag: np.ndarray, one: Layout, other: Layout) -> np.ndarray:
    """Covariance [n, m] of n samples and m others of one stationary process in each channel."""
    apart = np.abs(np.subtract.outer(one.sample, other.sample))
    return by_lag[apart] * np.equal.outer(one.channel, other.channel)


@in_float64
def gaussian(rng: np.random.Generator, covariance: np.ndarray, count: int) -> np.ndarray:
    """Draws [count, n] of mean zero; the covariance [n, n] may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    white = rng.normal(size=(count, len(values)))
    return (white * np.sqrt(np.maximum(values, 0.0))) @ vectors.T


@in_float64
def rest_noise(
    rests: list[np.ndarray], seed: int = 0, *, trend: int = 0, draws: int = DRAWS
) -> AutoregressiveNoise:
    """AR(1) noise of one size in all channels, from stretches in which nothing moved.

    The posterior of all that is left after a polynomial in time is taken from each channel
    (restricted likelihood, Harville 1974), under a prior flat in the log of the size and in the
    correlation up to .97.

    Args:
        rests: Stretches [samples, channels], without missing samples.
        seed: Fixes the draws.
        trend: Degree of the polynomial.
        draws: From the posterior.

    Raises:
        ValueError: stretches of another shape, not finite, or such as leave fewer than eight
            samples to learn from; a channel in which nothing varies, which measures no noise.
    """
    rests = [checked_array("each of rests", rest) for rest in rests]
    for rest in rests:
        if rest.ndim != 2 or not np.isfinite(rest).all():
            raise ValueError(
                "each of rests must be finite numbers [samples, channels], got the shape "
                f"{rest.shape} with {np.sum(~np.isfinite(rest))} missing; one channel is "
                "rest[:, None], and of a stretch with gaps give the stretches between them"
            )
    freedom = sum((len(rest) - trend - 1) * rest.shape[1] for rest in rests)
    if freedom < 8:
        raise ValueError(
            f"the stretches at rest leave {freedom} samples to learn the noise from, of 8 needed; "
            "give longer ones"
        )
    whole, left = np.concatenate(rests), [_detrended(rest, trend) for rest in rests]
    still = np.abs(np.concatenate(left)).max(0) <= ROUNDING * np.abs(whole).max(0)
    if still.any():
        channel = int(np.argmax(still))
        raise ValueError(
            f"rests do not vary in channel {channel}, got {whole[:3, channel]} and so on: that "
            "measures no noise; leave the channel out, or give noise of known size"
        )
    log_weight, squares = np.transpose([_restricted(rests, rho, trend) for rho in CORRELATIONS])
    log_weight = log_weight - 0.5 * freedom * np.log(squares)
    rng = np.random.default_rng(seed)
    which = rng.choice(len(log_weight), draws, p=softmax(log_weight))
    sd = np.sqrt(squares[which] / rng.chisquare(freedom, draws))
    return AutoregressiveNoise(sd, CORRELATIONS[which], sum(rest.size for rest in rests))


def _detrended(rest: np.ndarray, degree: int) -> np.ndarray:
    """Residuals of a stretch [samples, channels] about polynomials in time."""
    powers = np.linspace(-1.0, 1.0, len(rest))[:, None] ** np.arange(degree + 1)
    return rest - powers @ np.linalg.lstsq(powers, rest)[0]


def _restricted(rests: list[np.ndarray], rho: float, trend: int) -> tuple[float, float]:
    """Log determinants' part of the restricted likelihood, and the whitened sum of squares."""
    log_weight = squares = 0.0
    for rest in rests:
        steps = np.arange(len(rest))
        factor = np.linalg.cholesky(rho ** np.abs(np.subtract.outer(steps, steps)))
        powers = (steps / len(rest))[:, None] ** np.arange(trend + 1)
        columns = np.linalg.solve(factor, np.column_stack([powers, rest]))
        smooth, white = columns[:, : trend + 1], columns[:, trend + 1 :]
        left = white - smooth @ np.linalg.lstsq(smooth, white)[0]
        squares += np.sum(left**2)
        log_det = np.log(np.diag(factor)).sum() + 0.5 * np.linalg.slogdet(smooth.T @ smooth)[1]
        log_weight -= rest.shape[1] * log_det
    return log_weight, squares
