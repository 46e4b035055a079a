"""What a simulator usually gets wrong, learned from data believed to be clean."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..surrogates.measurement_noise import Layout
from .measurement_noise import Noise, SumOfNoises, gaussian

LEAST_OTHERS = 0.5  # weight of the other clean data by which one of them can be judged
MIN_FREEDOM = 3  # with fewer, draws have no variance and no effect would be found


@dataclass(frozen=True, eq=False)
class UsualResidual:
    """A simulator's own residual, as a Gaussian process of uncertain size.

    Its covariance has two parts: a stationary one, the clean data's mean autocovariance, and for
    data made by the same experiment the clean residuals themselves, each a direction in which the
    model may be as wrong again (Brynjarsdottir and O'Hagan 2014 on why the shape matters). They
    are added up, not averaged: averaged, what the simulator leaves of one liquid was found to be
    beyond what it leaves of the others.

    Attributes:
        autocovariance: Of clean residuals by lag in samples, shape [lags]; zero beyond.
        shapes: Clean residuals of the same experiment at each sample, shape [k, T, channels];
            NaN where missing.
        freedom: Weight of the clean data of this very experiment, or of all where there are none:
            the size is known as well as a variance from so many numbers, but never less than from
            MIN_FREEDOM.
        others: For each shape the autocovariance of all clean data but it, shape [k, lags]; none
            where there are no other clean data.
        weights: Of the shapes, shape [k]; 0 where the others tell next to nothing.
    """

    autocovariance: np.ndarray
    shapes: np.ndarray
    freedom: float
    others: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    weights: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def covariance(self, at: Layout) -> np.ndarray:
        apart = np.abs(np.subtract.outer(at.sample, at.sample))
        missing = max(apart.max() + 1 - len(self.autocovariance), 0)
        # over more samples than it was learned from, it must be made positive anew
        known = positive_autocovariance(np.append(self.autocovariance, np.zeros(missing)))
        stationary = known[apart] * np.equal.outer(at.channel, at.channel)
        shapes = self.shapes_at(at)
        return stationary + shapes.T @ shapes

    def leave_one_out(self) -> "list[UsualResidual]":
        """For each shape, what the other clean data teach."""
        left = [np.delete(self.shapes, k, axis=0) for k in range(len(self.others))]
        return [
            replace(self, autocovariance=autocovariance, shapes=shapes, others=self.others[:0])
            for autocovariance, shapes in zip(self.others, left, strict=True)
        ]

    def draw(self, rng: np.random.Generator, at: Layout, count: int) -> np.ndarray:
        drawn = gaussian(rng, self.covariance(at), count)
        freedom = max(self.freedom, MIN_FREEDOM)
        return np.sqrt(freedom / rng.chisquare(freedom, count))[:, None] * drawn

    def shapes_at(self, at: Layout) -> np.ndarray:
        """The clean residuals [k, n] at n samples; missing ones are zero."""
        flat = self.shapes[:, at.sample, at.channel] if self.shapes.size else None
        return np.zeros((0, len(at.sample))) if flat is None else np.nan_to_num(flat)


def usual_residual(
    residuals: Sequence[np.ndarray],
    noises: Sequence[Noise],
    same: Sequence[bool],
    weights: Sequence[float] | np.ndarray | None = None,
) -> UsualResidual:
    """What clean data teach.

    Args:
        residuals: Clean data less the calibrated simulator's mean, each [T, channels] with
            samples equally far apart; NaN where missing.
        noises: Of each one's measurement, which is not the simulator's fault.
        same: Which of them repeat the experiment that will be looked at, sample by sample.
        weights: How much each tells of the system that will be looked at, above 0 and at most 1;
            None where all tell the same. A simulator may err by much in one regime and by nothing
            in another.

    Raises:
        ValueError: there are none, or a weight is not above 0 and at most 1.
    """
    if not residuals:
        raise ValueError("a usual residual needs at least one clean data set")
    weight = np.ones(len(residuals)) if weights is None else np.asarray(weights, float)
    if weight.shape != (len(residuals),) or not ((weight > 0.0) & (weight <= 1.0)).all():
        raise ValueError(
            f"weights must be {len(residuals)} numbers above 0 and at most 1, got {weights}"
        )
    lags = max(len(residual) for residual in residuals)
    found = [_autocovariance(residual, lags) for residual in residuals]
    measured = [
        _expected_of(noise, len(residual), lags)
        for noise, residual in zip(noises, residuals, strict=True)
    ]
    each = np.array(found) - np.array(measured)
    repeated = [k for k, again in enumerate(same) if again]
    own = [max(1.0 - measured[k][0] / max(found[k][0], measured[k][0]), 0.0) for k in repeated]
    kept = [
        residuals[k] * np.sqrt(weight[k] * share) for k, share in zip(repeated, own, strict=True)
    ]
    others = [
        _mean(np.delete(each, k, axis=0), np.delete(weight, k)) for k in repeated if len(each) > 1
    ]
    return UsualResidual(
        autocovariance=positive_autocovariance(_mean(each, weight)),
        shapes=np.stack(kept) if kept else np.zeros((0, 0, 0)),
        freedom=float(weight[repeated].sum() if kept else weight.sum()),
        weights=np.array(
            [weight[k] * (weight.sum() - weight[k] >= LEAST_OTHERS) for k in repeated]
        ),
        others=np.reshape([positive_autocovariance(of) for of in others], (len(others), lags)),
    )


def _mean(rows: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return np.average(rows, axis=0, weights=weight)


def without_usual(noise: Noise) -> Noise:
    """The noise that is not the simulator's fault."""
    if not isinstance(noise, SumOfNoises):
        return noise
    return SumOfNoises(tuple(p for p in noise.parts if not isinstance(p, UsualResidual)))


def usual_in(noise: Noise) -> UsualResidual | None:
    """The part of the noise that is the simulator's fault, if any is known."""
    parts = noise.parts if isinstance(noise, SumOfNoises) else ()
    return next((part for part in parts if isinstance(part, UsualResidual)), None)


def usual_rms(noise: Noise) -> float:
    """RMS of what a simulator leaves of clean data, without noise; 0 where that is not known."""
    usual = usual_in(noise)
    return 0.0 if usual is None else float(np.sqrt(usual.autocovariance[0]))


def _autocovariance(residual: np.ndarray, lags: int) -> np.ndarray:
    """Biased estimate by lag, averaged over channels: it makes no negative variance."""
    filled = np.nan_to_num(residual)
    seen = max(int(np.isfinite(residual).sum()), 1)
    found = np.zeros(lags)
    for lag in range(len(filled)):
        found[lag] = np.sum(filled[lag:] * filled[: len(filled) - lag]) / seen
    return found


def _expected_of(noise: Noise, samples: int, lags: int) -> np.ndarray:
    """What `_autocovariance` is expected to find of so many samples of noise alone."""
    at = Layout(np.zeros(samples, int), np.arange(samples))
    found = np.zeros(lags)
    found[:samples] = noise.covariance(at)[0] * (1.0 - np.arange(samples) / samples)
    return found


def positive_autocovariance(autocovariance: np.ndarray) -> np.ndarray:
    """The nearest autocovariance whose spectrum is not negative."""
    even = np.concatenate([autocovariance, autocovariance[:0:-1]])
    spectrum = np.maximum(np.fft.rfft(even).real, 0.0)
    return np.fft.irfft(spectrum, len(even))[: len(autocovariance)]
