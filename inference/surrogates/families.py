"""The families of surrogates: what a user may choose of each, and how it learns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import check_callable, check_flag, checked_array, checked_integer, checked_number
from ..simulations.failures import Failure, not_finite
from ..types import Discrepancy
from .base import Measured, Surrogate, TrainingData
from .discrepancy import DiscrepancySurrogate, learn, with_threshold
from .emulator import PREDICTED_SHARE, Emulator, EmulatorLimits, emulate, goes_on, resized
from .given_noise import Covariance, NoiseModel, check_noise, given_noise
from .log_likelihood import LogLikelihoodFamily
from .noise.by_mean import ByMean, SdOfMean, law_of
from .noise.scales import OutputScale, Plain, comparable
from .output_vectors import Output, Summary, describe, infinities, summarise
from .signal import MIN_FREEDOM, SignalSurrogate, observe
from .squared_difference import evaluate, failed_on, independent, numbers, squared_difference
from .success import learn_success
from .threshold import Matched, Threshold, check_rule
from .transform import check_transform
from .warnings import GUESSED, NEGATIVE, distance_warnings

MAX_COMPONENTS = 8
LEFT_OF_NOISE = 0.02  # of the variance of noise by the mean, that components may leave


@dataclass(frozen=True)
class DiscrepancyFamily:
    """A Gaussian process on the discrepancy, and a threshold on it: the paper's.

    Attributes:
        discrepancy: Callable (observed, simulated) -> float; None is `squared_difference()`.
        transform: "identity", "sqrt" or "log" of the discrepancy; None chooses by
            leave-one-out log predictive density.
        threshold: Rule for eps; None makes the posterior as wide as the closest run's residual
            suggests, see `threshold.matched`, or guesses of fewer than 3 numbers more than
            parameters; or a number on the discrepancy's own scale, which may be
            negative where a user's discrepancy is, as a logarithm; see
            `threshold.choose_threshold`.
    """

    name: ClassVar[str] = "discrepancy"
    acquisition: ClassVar[str] = "cautious"
    replicates: ClassVar[bool] = False

    discrepancy: Discrepancy | None = None
    transform: str | None = None
    threshold: Threshold = None

    def __post_init__(self) -> None:
        check_rule(self.threshold)
        check_callable("discrepancy", self.discrepancy)
        check_transform(self.transform)

    def learner(self, observed: np.ndarray) -> "DiscrepancyLearner":
        return DiscrepancyLearner(self, _distance(self.discrepancy, observed), observed)


@dataclass(frozen=True, eq=False)
class DiscrepancyLearner:
    """`DiscrepancyFamily` in view of what was observed."""

    family: DiscrepancyFamily
    distance: Discrepancy
    observed: np.ndarray

    @property
    def any_shape(self) -> bool:
        """Whether signals may have another shape than what was observed."""
        return self.family.discrepancy is not None

    def measure(self, signals: Sequence[np.ndarray | None]) -> Measured:
        """Features [n, m] and discrepancies of n signals, None where a run failed.

        The features are the signal, NaN where it has another shape than what was observed.
        """
        features = np.full((len(signals), self.observed.size), np.nan)
        for row, signal in zip(features, signals, strict=True):
            if signal is not None and signal.shape == self.observed.shape:
                row[:] = signal.ravel()
        return Measured(features, *evaluate(self.distance, self.observed, signals))

    def learn(
        self, known: TrainingData, previous: DiscrepancySurrogate | None
    ) -> DiscrepancySurrogate:
        """To search with: errors count as independent, lest a poor start leave it undecided."""
        return self._learn(known, previous, self._rule(known, numbers))

    def _learn(
        self, known: TrainingData, previous: DiscrepancySurrogate | None, rule: Threshold
    ) -> DiscrepancySurrogate:
        transform = self.family.transform
        learned = learn(known.u, known.discrepancy, transform, previous, known.normal)
        learned = replace(learned, success=learn_success(known.runs, known.normal))
        return learned if rule is None else with_threshold(learned, rule)

    def _rule(self, known: TrainingData, number: Callable[..., float]) -> Threshold:
        """The threshold that was given, or the one that fits the closest run's residual."""
        residual = self._residual(known)
        if self.family.threshold is not None or numbers(residual) - known.u.shape[1] < MIN_FREEDOM:
            return self.family.threshold
        return Matched(number(residual))

    def _residual(self, known: TrainingData) -> np.ndarray:
        """By which the closest run misses what was observed, NaN where nothing can be said."""
        closest = known.features[np.argmin(known.discrepancy)]
        return closest.reshape(self.observed.shape) - self.observed

    def finish(self, known: TrainingData) -> Surrogate:
        """The surrogate on which a fit rests."""
        rule = self._rule(known, independent)
        learned = self._learn(known, None, rule)
        said = () if rule is not None else (GUESSED,)
        if self.family.threshold is None and known.discrepancy.min() < 0.0:
            said = (NEGATIVE,)
        if self.family.discrepancy is None:
            order = np.argsort(known.discrepancy)
            outputs = known.features[order].reshape(-1, *self.observed.shape)
            said += tuple(distance_warnings(self.observed, outputs))
        return replace(learned.cautious, said=said)


@dataclass(frozen=True, eq=False)
class SignalFamily:
    """Principal components of the output, a Gaussian process for each score.

    Attributes:
        summary: Callable output -> vector, of the observed and of each simulated output; None
            takes the output as it is.
        noise: Measurement noise that the simulator does not make: its sd, a number or an array
            shaped like the observed (summarised) output; or sds [n], or a covariance [n, n], of
            that output's n finite values, flattened; or an object that has such a covariance, as
            `criticism.KnownNoise`, `model_error` and their `SumOfNoises`; 0 for none. "poisson"
            where counts were observed and their means are simulated; `relative(0.2)` for an sd of
            20 % of the simulated mean; or a function from simulated means to sds, value by value.
            None estimates it: as an AR(1) process where the output is a series, of at least 5
            samples without a summary.
        varying_noise: Whether the noise that the simulator makes itself may depend on the
            parameters and on the mean, where runs show that it does.
        misfit: Prior probability that the data are missed by more than the given noise, because
            the simulator errs or the noise is larger; its size is integrated out. 0 for never.
        components: At most.
        predicted: Share of a component's variance that the parameters must predict where its
            run is left out; what they predict less counts as run-to-run noise. None emulates
            every component, and takes some noise for structure if the simulator is noisy.
        discrepancy: As in `DiscrepancyFamily`; it only ranks simulations and finds outputs that
            blew up.
    """

    name: ClassVar[str] = "signal"
    acquisition: ClassVar[str] = "draws"
    replicates: ClassVar[bool] = True

    summary: Summary | None = None
    noise: ArrayLike | Covariance | SdOfMean | None = None
    misfit: float = 0.1
    components: int = MAX_COMPONENTS
    predicted: float | None = PREDICTED_SHARE
    discrepancy: Discrepancy | None = None
    varying_noise: bool = True

    def __post_init__(self) -> None:
        check_callable("summary", self.summary)
        check_callable("discrepancy", self.discrepancy)
        check_flag("varying_noise", self.varying_noise)
        checked_integer("components", self.components)
        if self.noise is not None and law_of(self.noise) is None:
            check_noise(self.noise)  # pyright: ignore[reportArgumentType]  no function is left
        checked_number("misfit", self.misfit, lambda p: 0.0 <= p < 1.0, "from 0 to below 1")
        if self.predicted is not None:
            due = "None or from 0 to below 1"
            checked_number("predicted", self.predicted, lambda share: 0.0 <= share < 1.0, due)

    def learner(self, observed: np.ndarray) -> "SignalLearner":
        output = describe(observed, self.summary)
        values = output.values(observed)
        distance = self.discrepancy or partial(_of_summaries, self.summary)
        return SignalLearner(self, output, distance, observed, values, self._scale(output, values))

    def _scale(self, output: Output, values: np.ndarray) -> OutputScale:
        """On which outputs are emulated, `values` [m] being observed."""
        law = law_of(self.noise)
        if law is not None:
            return ByMean(law, values, output.counts)
        given = None if self.noise is None else given_noise(self.noise, output)  # pyright: ignore[reportArgumentType]  no function is left
        return Plain(values, given)


@dataclass(frozen=True, eq=False)
class SignalLearner:
    """`SignalFamily` in view of what was observed."""

    family: SignalFamily
    output: Output
    distance: Discrepancy
    observed: np.ndarray
    values: np.ndarray
    scale: OutputScale

    @property
    def any_shape(self) -> bool:
        """Whether signals may have another shape than what was observed."""
        return self.family.summary is not None

    def measure(self, signals: Sequence[np.ndarray | None]) -> Measured:
        """Features [n, m] and discrepancies of n signals, None where a run failed."""
        named = "summary" if self.family.discrepancy is None else "discrepancy"
        discrepancy, errors = evaluate(self.distance, self.observed, signals, named)
        features = np.full((len(signals), len(self.values)), np.nan)
        for i, signal in enumerate(signals):
            if signal is None or not np.isfinite(discrepancy[i]):
                errors[i] = errors[i] or self._infinite_summary(signal)
                continue
            try:
                features[i] = self.output.values(signal)
            except (Exception, SystemExit) as error:  # of the user's summary
                errors[i] = failed_on("summary", signal, self.observed, error)
            try:
                self.scale.check(features[i])
            except (Exception, SystemExit) as error:  # of the user's function of the mean
                errors[i], features[i] = failed_on("noise", signal, self.observed, error), np.nan
        failed = ~np.isfinite(features).all(1)
        return Measured(features, np.where(failed, np.nan, discrepancy), errors)

    def _infinite_summary(self, signal: np.ndarray | None) -> Failure | None:
        """The failure of a run whose signal is finite and its summary is not."""
        compared = self.family.summary is not None and self.family.discrepancy is None
        if not compared or signal is None or not np.isfinite(signal).all():
            return None
        values = summarise(self.family.summary, signal)
        finite = bool(np.isfinite(values).all())
        return None if finite else not_finite(f"summary returns {infinities(values)}")

    def learn(self, known: TrainingData, previous: SignalSurrogate | None) -> SignalSurrogate:
        u, values = known.u, known.features
        if previous is not None and not goes_on(previous.emulator, previous.scale.of(values)):
            previous = None
        scale = self._fitting(u, values) if previous is None else previous.scale
        emulator = self._emulator(known, scale, previous)
        success = learn_success(known.runs, known.normal)

        def compared(at: np.ndarray | None) -> SignalSurrogate:
            """With what was observed, its noise being right around the features `at` [m]."""
            seen, given = scale.seen(at)
            noise = NoiseModel(given, self.family.misfit)
            found = observe(emulator, self.output, seen, noise, previous)
            return replace(found, success=success, scale=scale)

        found = compared(None)
        for _ in range(scale.rounds - 1):
            found = compared(found.best_features)
        return found

    def _fitting(self, u: np.ndarray, values: np.ndarray) -> OutputScale:
        """The scale for runs of values [n, m] at u [n, d]."""
        if not (self.family.varying_noise and isinstance(self.scale, Plain)):
            return self.scale
        return self.scale.fitting(u, values, self.output.layout.channel)

    def _emulator(
        self, known: TrainingData, scale: OutputScale, previous: SignalSurrogate | None
    ) -> Emulator:
        left = LEFT_OF_NOISE if isinstance(scale, ByMean) else np.inf
        limits = EmulatorLimits(self.family.components, self.family.predicted, left)
        features, units = scale.of(known.features), comparable(scale, self.output)
        old = None if previous is None else previous.emulator
        found = emulate(known.u, features, units, limits, old, known.normal)
        return found if old or not self.family.varying_noise else resized(found, units)

    def finish(self, known: TrainingData) -> Surrogate:
        """The surrogate on which a fit rests."""
        return self.learn(known, None)


Family = DiscrepancyFamily | SignalFamily | LogLikelihoodFamily
FAMILIES: dict[str, type[Family]] = {
    family.name: family for family in (DiscrepancyFamily, SignalFamily, LogLikelihoodFamily)
}
"""Surrogates by the name users give."""


def resolve(surrogate: str | Family | None, options: dict) -> Family:
    """The family that `fit`'s arguments `surrogate` and `options` name.

    None is "signal", unless a discrepancy, or another option of that family alone, is given.

    Raises:
        ValueError: unknown name, an option that the family has not, or without a name a
            discrepancy and an option of "signal".
    """
    if isinstance(surrogate, Family):
        if options:
            raise ValueError(f"give {tuple(options)} to {surrogate!r} itself")
        return surrogate
    if surrogate is None:
        for_discrepancy = (_options("discrepancy") - _options("signal")) | {"discrepancy"}
        for_signal = _options("signal") - _options("discrepancy")
        given = {name for name, value in options.items() if value is not None}
        of_paper, of_signal = for_discrepancy & given, for_signal & given
        if "discrepancy" in of_paper and of_signal:
            raise ValueError(
                f"discrepancy and {', '.join(sorted(of_signal))} belong to two surrogates: leave "
                'one out, or say surrogate="signal", to which a discrepancy only ranks simulations'
            )
        surrogate = "discrepancy" if of_paper and not of_signal else "signal"
        options = {n: v for n, v in options.items() if v is not None or n in _options(surrogate)}
    if surrogate not in tuple(FAMILIES):
        raise ValueError(f"surrogate must be one of {tuple(FAMILIES)} or None, got {surrogate!r}")
    unknown = options.keys() - _options(surrogate)
    if unknown:
        raise ValueError(
            f"there is no argument {', '.join(sorted(unknown))}; the surrogate {surrogate!r} has "
            f"the options {tuple(sorted(_options(surrogate)))}"
        )
    return FAMILIES[surrogate](**options)


def checked_observed(observed: ArrayLike | None, family: Family) -> np.ndarray:
    """The observed output; NaN where the simulator returns the likelihood.

    Raises:
        ValueError: something was observed but shall not, or shall but was not, or is infinite.
    """
    if isinstance(family, LogLikelihoodFamily):
        if observed is None:
            return np.array(np.nan)
        raise ValueError(
            'surrogate="log_likelihood" takes no observed: the simulator compares with the data '
            f"itself, and returns the log likelihood; leave it out, got {observed!r:.100}"
        )
    if observed is None:
        raise ValueError(
            "observed must be an array of numbers, got None; a simulator that returns the log "
            'likelihood needs surrogate="log_likelihood", losses need fit_losses'
        )
    array = checked_array("observed", observed)
    if np.isinf(array).any():
        raise ValueError("observed must not be infinite; NaN is a missing sample")
    return array


def _options(name: str) -> set[str]:
    return {field.name for field in fields(FAMILIES[name])}


def _distance(discrepancy: Discrepancy | None, observed: np.ndarray) -> Discrepancy:
    if discrepancy is not None:
        return discrepancy
    distance = squared_difference()
    distance(observed, observed)  # raises if it cannot be used
    return distance


def _of_summaries(summary: Summary | None, observed: np.ndarray, simulated: np.ndarray) -> float:
    """Sum of squared differences of (summarised) outputs, missing samples left out."""
    a, b = (summarise(summary, output) for output in (observed, simulated))
    if a.shape != b.shape:
        raise ValueError(f"expected an output of shape {a.shape}, as observed, got {b.shape}")
    there = np.isfinite(a)
    with np.errstate(all="ignore"):  # of a run that blew up
        return float(np.sum((a[there] - b[there]) ** 2))
