"""The paper's surrogate: a Gaussian process on the (transformed) discrepancy."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from ..arguments import check_callable, check_choice
from ..gp.hyperparameters import GROWTH, maximum_a_posteriori
from ..gp.process import GP, Data, condition, leave_one_out_log_densities, predict
from ..types import Discrepancy
from . import warnings
from .base import Family, Measured, TrainingData, flattened
from .processes import OfOneProcess, learn_success
from .squared_difference import MIN_FREEDOM, evaluate, independent, numbers, squared_difference
from .threshold import (
    TRANSFORMS,
    Matched,
    Threshold,
    ThresholdLikelihood,
    Transform,
    candidates,
    check_rule,
    choose_threshold,
    matched,
)

BETWEEN = 0.25  # of the least simulated discrepancy: the least that is taken for its minimum
MIN_RESOLUTION = 1e-4  # of the spread of g(Delta)
UNKNOWN_FREEDOM = 20.0  # errors more than parameters, where nothing tells their number
LOW = 3.0  # sds of a new discrepancy by which a threshold lies too low
BEST_SHARE = 0.25  # of the runs, which tell how far discrepancies spread
MAX_DEVIATIONS = 1e9  # of that spread, beyond which a discrepancy is absurd
TRANSFORM_GROWTH = 1.3  # the transform is chosen anew when data have grown by this factor


class DiscrepancyScale(NamedTuple):
    """From the discrepancy to the process's targets: (g(Delta) - location) / spread."""

    transform: Transform
    location: float
    spread: float

    def __call__(self, discrepancy: np.ndarray) -> np.ndarray:
        return (self.transform(discrepancy) - self.location) / self.spread


@dataclass(frozen=True, eq=False)
class DiscrepancySurrogate(OfOneProcess):
    """GP of g(Delta); see `learn`.

    Attributes:
        values: The discrepancies.
        scale: g, and the standardisation of g(Delta).
        chosen_at: Simulations known when the transform was chosen.
        threshold: eps on the scale of g(Delta).
        width: Sd that the threshold has itself, on that scale.
        noisy: Whether the noise of g(Delta) alone makes the posterior wider than the data do, as
            far as the threshold is `Matched`.
        resolution: Sd on that scale from which doubt counts against a place, see
            `ThresholdLikelihood`; infinite while it shall attract runs.
        said: What the outputs, of which the surrogate knows nothing, have been found to lack.
    """

    scale: DiscrepancyScale
    chosen_at: int
    threshold: float = np.nan
    width: float = 0.0
    noisy: bool = False
    resolution: float = np.inf
    said: tuple[str, ...] = ()

    @property
    def equal(self) -> bool:
        """Whether all discrepancies are the same, but for rounding."""
        return bool(np.ptp(self.scale(self.values)) < 0.5)  # of what has an sd of 1

    @property
    def transform(self) -> Transform:
        return self.scale.transform

    @cached_property
    def log_likelihood(self) -> ThresholdLikelihood:  # pyright: ignore  nobody sets it
        threshold = (self.threshold - self.scale.location) / self.scale.spread
        width, resolution = (
            np.asarray(part / self.scale.spread) for part in (self.width, self.resolution)
        )
        return ThresholdLikelihood(self.gp, np.asarray(threshold), width, resolution, self.success)

    @property
    def cautious(self) -> "DiscrepancySurrogate":
        """The surrogate to which doubt beyond what the threshold can resolve is no agreement."""
        mean, _ = self.predict(self.u)
        noise = self.scale.spread * float(np.exp(self.gp.hyper.log_noise[0]))
        scales = float(np.hypot(noise, self.width)), self.threshold - float(mean.min())
        return replace(self, resolution=max(*scales, MIN_RESOLUTION * self.scale.spread))

    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new g(Delta), its noise included, at quantiles u [n, d]: [n], [n]."""
        mean, sd = self.new_target(u)
        return self.scale.location + self.scale.spread * mean, self.scale.spread * sd

    def predicted(self, features: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """g(Delta) [n], capped at the worst run that was learned from."""
        return self.transform(np.minimum(discrepancy, self.values.max()))

    def lower_bound(self, u: np.ndarray, width: float) -> np.ndarray:
        """mu - width sqrt(v) at u [n, d], v the variance of the latent mean (without noise).

        In standard deviations of the targets, less the log chance that a run at u succeeds.
        """
        (mean,), (variance,) = predict(self.gp, u)
        return mean - width * np.sqrt(variance) - self.log_success(u)

    def constants(self) -> dict[str, np.ndarray]:
        """The threshold, on the scale of g(Delta)."""
        return {"threshold": np.asarray(self.threshold)}

    def described(self) -> list[str]:
        """The threshold, on the scale of the discrepancy."""
        return [f"threshold {float(self.transform.inverse(np.asarray(self.threshold))):.3g}"]

    @property
    def fits(self) -> bool:
        """Whether discrepancies as low as the threshold can be expected anywhere."""
        mean, sd = self.predict(self.u)
        low = LOW * np.hypot(sd, self.width)
        return self.equal or bool((self.threshold > mean - low).any())

    def warnings(self, *, confirmed: bool = False) -> list[str]:
        """Warnings of the process's errors, unless it is confirmed, and of what was compared."""
        if self.equal:
            return [warnings.EQUAL]
        said = [*self.said]
        if not confirmed:
            said += warnings.complaints(self.checks()["loo_z"], "discrepancy")
        if self.noisy:
            said.append(warnings.NOISY)
        return said if self.fits else [*said, warnings.LOW_THRESHOLD]

    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new discrepancy for each row of u [n, d]."""
        mean, sd = self.predict(u)
        drawn = mean + sd * rng.normal(size=mean.shape)
        return {"discrepancy": self.transform.inverse(drawn)}


def learn(
    u: np.ndarray,
    discrepancy: np.ndarray,
    transform: str | None = None,
    previous: DiscrepancySurrogate | None = None,
    tails: np.ndarray | None = None,
    rule: Threshold = None,
) -> DiscrepancySurrogate:
    """Fit the surrogate.

    A run that blew up is learned as the worst of the others: the process need not follow it, but
    shall know that it is bad there. Of the transforms identity, sqrt and log the one with the
    highest leave-one-out log predictive density of the discrepancy itself (Jacobian included)
    is taken, unless given.

    Args:
        u: Prior quantiles [n, d].
        discrepancy: Finite values [n], n >= 2.
        transform: A name, or None to choose.
        previous: Learned from the first of these data; its hyperparameters are kept until the
            data have grown by GROWTH, its transform until they have by TRANSFORM_GROWTH.
        tails: Ends at which the parameters fade out [d], see `gp.process.coordinates`.
        rule: See `with_threshold`.

    Raises:
        ValueError: bad transform, or undefined at the given threshold.
    """
    values = np.minimum(discrepancy, discrepancy[~is_outlier(discrepancy)].max())
    n = len(u)
    with np.errstate(divide="ignore", invalid="ignore"):  # where the transform is undefined
        fits = previous is not None and np.isfinite(previous.scale(values)).all()
    grown = previous is None or n >= TRANSFORM_GROWTH * previous.chosen_at
    if previous is not None and fits and not (grown or previous.equal):
        data = Data(u, previous.scale(values)[None], tails)
        hyper, learned_at = previous.gp.hyper, previous.learned_at
        if n >= GROWTH * learned_at:
            hyper, learned_at = maximum_a_posteriori(data, hyper), n
        learned = replace(previous, gp=condition(hyper, data), values=values, learned_at=learned_at)
        return with_threshold(learned, rule)
    options = [_standardise(option, values) for option in candidates(transform, values)]
    every = [Data(u, scale(values)[None], tails) for scale in options]
    fitted = [condition(maximum_a_posteriori(data), data) for data in every]
    scores = [_score(gp, scale, values) for gp, scale in zip(fitted, options, strict=True)]
    best = int(np.argmax(scores))
    chosen = DiscrepancySurrogate(fitted[best], values, n, options[best], n)
    return with_threshold(chosen, rule)


def is_outlier(discrepancy: np.ndarray) -> np.ndarray:
    """Which of the discrepancies [n] are absurdly larger than the best quarter, bool [n]; NaN is
    not. Most runs may have blown up, or hold a number such as 1e16 in place of infinity."""
    deviation = discrepancy - np.nanmin(discrepancy, initial=np.inf)
    finite = deviation[np.isfinite(deviation)]
    spread = np.quantile(finite, BEST_SHARE) if finite.size else 0.0
    return (deviation / MAX_DEVIATIONS > spread) & (spread != 0.0)


def with_threshold(learned: DiscrepancySurrogate, rule: Threshold) -> DiscrepancySurrogate:
    """The surrogate with the threshold that a rule chooses, see `threshold.choose_threshold`.

    Raises:
        ValueError: the transform is undefined at the given threshold.
    """
    mean, sd = learned.predict(learned.u)
    i = np.argmin(mean)
    least = float(mean[i]), float(sd[i])
    if rule is not None and not isinstance(rule, Matched):
        threshold = choose_threshold(rule, learned.values, learned.transform, least)
        return replace(learned, threshold=threshold, width=0.0, noisy=False)
    d = learned.u.shape[1]
    matching = Matched(d + UNKNOWN_FREEDOM) if rule is None else rule
    between, its_sd = (float(part[0]) for part in learned.predict(learned.best()[None]))
    # between the runs the least may be lower, but not out of all proportion
    if learned.transform.inverse(np.asarray(between)) > BETWEEN * learned.values.min():
        least = min(least, (between, its_sd))
    threshold, width = matched(matching, *least, learned.transform, d)
    return replace(learned, threshold=threshold, width=width, noisy=width == 0.0)


def _standardise(transform: Transform, values: np.ndarray) -> DiscrepancyScale:
    transformed = transform(values)
    size = float(np.abs(transformed).max())
    with np.errstate(over="ignore"):
        spread, rounding = float(transformed.std()), 1e-12 * size
    if not np.isfinite(spread):  # the squares of large numbers overflow
        spread = size * float((transformed / size).std())
    # all equal: nothing to standardise
    return DiscrepancyScale(
        transform, float(transformed.mean()), spread if spread > rounding else 1.0
    )


def _score(gp: GP, scale: DiscrepancyScale, values: np.ndarray) -> float:
    """Leave-one-out log predictive density of the discrepancy under the scale, summed over the
    better half of the runs: with a wide prior the others only tell that they are bad."""
    (density,) = leave_one_out_log_densities(gp)
    jacobian = scale.transform.log_jacobian(values) - np.log(scale.spread)
    return float(np.sum((density + jacobian)[values <= np.median(values)]))


@dataclass(frozen=True)
class DiscrepancyFamily(Family):
    """A Gaussian process on the discrepancy, and a threshold on it: the paper's.

    Attributes:
        discrepancy: Callable (observed, simulated) -> float; None is `squared_difference()`.
        transform: "identity", "sqrt" or "log" of the discrepancy; None chooses by
            leave-one-out log predictive density.
        threshold: Rule for eps; None makes the posterior as wide as the closest run's residual
            suggests, were the discrepancy a sum of squares, see `threshold.matched`, or guesses of
            fewer than 3 numbers more than parameters; or a number on the discrepancy's own scale,
            which may be negative where a user's discrepancy is, as a logarithm; see
            `threshold.choose_threshold`.
    """

    name: ClassVar[str] = "discrepancy"
    acquisition: ClassVar[str] = "cautious"
    has_lower_bound: ClassVar[bool] = True

    discrepancy: Discrepancy | None = None
    transform: str | None = None
    threshold: Threshold = None

    def __post_init__(self) -> None:
        check_rule(self.threshold)
        check_callable("discrepancy", self.discrepancy)
        check_choice("transform", self.transform, (*TRANSFORMS, None))

    @property
    def any_shape(self) -> bool:
        return self.discrepancy is not None

    def view(self, observed: np.ndarray) -> np.ndarray:
        if self.discrepancy is None:
            squared_difference()(observed, observed)  # raises if it cannot be used
        return observed

    def measure(self, observed: np.ndarray, signals: Sequence[np.ndarray | None]) -> Measured:
        """Features are the signal, NaN where it has another shape than what was observed."""
        distance = self.discrepancy or squared_difference()
        return Measured(flattened(observed, signals), *evaluate(distance, observed, signals))

    def search(
        self, data: TrainingData, key: np.ndarray, previous: DiscrepancySurrogate | None
    ) -> DiscrepancySurrogate:
        """Errors count as independent, lest a poor start leave it undecided."""
        return self._learn(data, previous, self._rule(data, numbers))

    def learn(self, data: TrainingData, key: np.ndarray) -> DiscrepancySurrogate:
        rule = self._rule(data, independent)
        said = () if rule is not None else (warnings.GUESSED,)
        if self.threshold is None and data.discrepancy.min() < 0.0:
            said = (warnings.NEGATIVE,)
        if self.discrepancy is None:
            order = np.argsort(data.discrepancy)
            outputs = data.features[order].reshape(-1, *data.observed.shape)
            said += tuple(warnings.distance_warnings(data.observed, outputs))
        return replace(self._learn(data, None, rule).cautious, said=said)

    def _learn(
        self, data: TrainingData, previous: DiscrepancySurrogate | None, rule: Threshold
    ) -> DiscrepancySurrogate:
        learned = learn(data.u, data.discrepancy, self.transform, previous, data.tails, rule)
        return replace(learned, success=learn_success(data.runs, data.tails))

    def _rule(self, data: TrainingData, number: Callable[[np.ndarray], float]) -> Threshold:
        """The threshold that was given, or the one that fits the residual of the closest run."""
        closest = data.features[np.argmin(data.discrepancy)]
        residual = closest.reshape(data.observed.shape) - data.observed
        if self.threshold is not None or numbers(residual) - data.u.shape[1] < MIN_FREEDOM:
            return self.threshold
        return Matched(number(residual))
