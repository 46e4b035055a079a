"""Outputs of any shape as vectors that an emulator can learn."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arguments import checked_array
from ..simulations.failures import raised
from .measurement_noise import Layout

MIN_SERIES = 5  # samples from which an output counts as a series, whose values share a scale
MIN_LONG = 16  # samples of a series from which their residual tells the size of the noise
MIN_UNIT = 1e-100  # smaller numbers have no square
MAX_VALUES = 2000  # values; neighbouring samples of longer series are averaged

Summary = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Output:
    """Map from an output [*signal_shape] to values [m], channel after channel, time inside.

    Attributes:
        summary: The user's function of one output, or None.
        shape: Of the summarised output.
        present: Flat indices of what was observed, in the order of the values before averaging.
        layout: Where the values lie.
        starts: Rows of `present` at which the values begin; several samples of one value are
            averaged.
        series: Whether the first axis is time.
    """

    summary: Summary | None
    shape: tuple[int, ...]
    present: np.ndarray
    layout: Layout
    starts: np.ndarray
    series: bool

    @property
    def complete(self) -> bool:
        """Whether the values are the whole output, as it is."""
        return self.summary is None and len(self.starts) == int(np.prod(self.shape))

    @property
    def long(self) -> bool:
        """Whether it is a series so long that its residual tells the size of the noise."""
        return self.series and len(np.unique(self.layout.sample)) >= MIN_LONG

    @property
    def counts(self) -> np.ndarray:
        """Samples that are averaged for each value [m]."""
        return np.diff(np.append(self.starts, len(self.present)))

    def values(self, output: np.ndarray) -> np.ndarray:
        """[m] of one output.

        Raises:
            ValueError: the (summarised) output has another shape than the observed one.
        """
        summarised = summarise(self.summary, output)
        check_shape("a summary" if self.summary else "an output", self.shape, summarised.shape)
        return self.average(summarised.ravel()[self.present])

    def average(self, samples: np.ndarray) -> np.ndarray:
        """Samples [len(present), ...] in the order of the values -> [m, ...]."""
        sums = np.add.reduceat(samples, self.starts, axis=0)
        return sums / self.counts.reshape(-1, *[1] * (samples.ndim - 1))

    @property
    def rank(self) -> np.ndarray:
        """Place in the flattened order of each sample, in the order of the values [samples]."""
        return np.argsort(np.argsort(self.present))

    def average_covariance(self, covariance: np.ndarray) -> np.ndarray:
        """Of samples in the flattened order [len(present), len(present)] -> of values [m, m]."""
        rank = self.rank
        return self.average(self.average(covariance[np.ix_(rank, rank)]).T)

    def restore(self, values: np.ndarray) -> np.ndarray:
        """Values [n, m] at their places in the (summarised) output: [n, *shape]; NaN elsewhere."""
        full = np.full((len(values), int(np.prod(self.shape))), np.nan)
        full[:, self.present] = np.repeat(values, self.counts, axis=1)
        return full.reshape(len(values), *self.shape)

    def scale(self, values: np.ndarray) -> np.ndarray:
        """Scales of values [n, m], [m]: the sd of a series' channel, or of a value."""
        variance = (values - values[0]).var(0)
        rounding = 1e-12 * np.abs(values).max(0)
        variance = np.where(variance > rounding**2, variance, 0.0)
        if self.series:
            channel = self.layout.channel
            mean = np.bincount(channel, variance) / np.bincount(channel)
            variance = mean[channel]
        # a constant simulator has no other unit than its output, if that has a square
        size = np.abs(values).max()
        unit = size if size > MIN_UNIT and not variance.any() else 1.0
        return np.where(variance > 0, np.sqrt(variance), unit)


def check_shape(what: str, observed: tuple[int, ...], simulated: tuple[int, ...]) -> None:
    """Raise ValueError where what was simulated has another shape than what was observed."""
    if observed != simulated:
        raise ValueError(f"expected {what} of shape {observed}, as observed, got {simulated}")


def summarise(summary: Summary | None, output: np.ndarray) -> np.ndarray:
    """float64, at least one-dimensional; a summary may write into the copy that it is given."""
    raw = output if summary is None else summary(output.copy())
    name = "an output" if summary is None else "what summary returns"
    return np.atleast_1d(checked_array(name, raw))


def infinities(values: np.ndarray) -> str:
    """Counts of values that are not finite, such as "-inf in 3 of 60 values"."""
    found = zip(*np.unique(values[~np.isfinite(values)], return_counts=True), strict=True)
    return f"{', '.join(f'{value} in {n}' for value, n in found)} of {values.size} values"


def describe(observed: np.ndarray, summary: Summary | None) -> Output:
    """The map from outputs like `observed` to values; NaN is a missing sample.

    Raises:
        ValueError: nothing is finite, something is infinite, or the summary fails.
    """
    try:
        summarised = summarise(summary, observed)
    except (Exception, SystemExit) as error:  # whatever the user's code raises
        raise ValueError(
            f"the summary failed on observed, of shape {observed.shape} ({raised(error)}); it is "
            "called with one output, not with a batch of them"
        ) from error
    finite = np.isfinite(summarised)
    if np.isinf(summarised).any():
        raise ValueError(
            f"summary must not return infinite values, got {infinities(summarised)} of observed; "
            "leave them out, or choose another summary, such as np.log1p for np.log of zeros"
        )
    if not finite.any():
        named = "observed" if summary is None else "the summary of observed"
        raise ValueError(f"{named} must have a finite value, got none")
    filled = finite.reshape(len(finite), -1).any(1).sum()
    series = summary is None and filled >= MIN_SERIES
    # channel after channel, time inside
    index = np.arange(summarised.size).reshape(summarised.shape)
    index = np.moveaxis(index, 0, -1).ravel() if series else index.ravel()
    present = index[finite.ravel()[index]]
    channel, sample, block = np.zeros(len(present), int), np.arange(len(present)), 1
    if series:
        channels, block = int(np.prod(summarised.shape[1:])), -(-len(present) // MAX_VALUES)
        channel = np.unique(present % channels, return_inverse=True)[1]
        sample = present // channels // block
    new = (np.diff(channel, prepend=-1) != 0) | (np.diff(sample, prepend=-1) != 0)
    starts = np.flatnonzero(new)  # of samples of one channel and one block of time
    layout = Layout(channel[starts], sample[starts])
    return Output(summary, summarised.shape, present, layout, starts, series)
