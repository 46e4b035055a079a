"""The paper's surrogate: a Gaussian process on the (transformed) discrepancy."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..gp.hyperparameters import GROWTH, maximum_a_posteriori
from ..gp.optimise import surely_least
from ..gp.process import (
    GP,
    Data,
    condition,
    fantasize,
    leave_one_out,
    leave_one_out_errors,
    predict,
)
from .threshold import (
    Matched,
    Threshold,
    ThresholdState,
    choose_threshold,
    log_likelihood,
    log_second_moment,
    matched,
)
from .transform import Transform, candidates
from .warnings import (
    EQUAL,
    LOW_THRESHOLD,
    NOISY,
    complaints,
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
class DiscrepancySurrogate:
    """GP of g(Delta); see `learn`.

    Attributes:
        gp: The conditioned process.
        scale: g, and the standardisation of g(Delta).
        discrepancy: What was learned from [n].
        threshold: eps on the scale of g(Delta).
        learned_at: Simulations known when the hyperparameters were found.
        chosen_at: Simulations known when the transform was chosen.
        success: Where runs succeed, see `success.learn_success`.
        width: Sd that the threshold has itself, on the scale of g(Delta).
        noisy: Whether the noise of g(Delta) alone makes the posterior wider than the data do, as
            far as the threshold is `Matched`.
        resolution: Sd on the scale of g(Delta) from which doubt counts against a place, see
            `threshold.log_likelihood`; infinite while it shall attract runs.
        said: What the outputs, of which the surrogate knows nothing, have been found to lack.
    """

    gp: GP
    scale: DiscrepancyScale
    discrepancy: np.ndarray
    threshold: float
    learned_at: int
    chosen_at: int
    success: GP | None = None
    width: float = 0.0
    noisy: bool = False
    resolution: float = np.inf
    said: tuple[str, ...] = ()

    log_likelihood = staticmethod(log_likelihood)
    log_second_moment = staticmethod(log_second_moment)

    @property
    def equal(self) -> bool:
        """Whether all discrepancies are the same, but for rounding."""
        return bool(np.ptp(self.scale(self.discrepancy)) < 0.5)  # of what has an sd of 1

    @property
    def transform(self) -> Transform:
        return self.scale.transform

    @property
    def state(self) -> ThresholdState:
        threshold = (self.threshold - self.scale.location) / self.scale.spread
        width, resolution = (
            np.asarray(part / self.scale.spread) for part in (self.width, self.resolution)
        )
        return ThresholdState(self.gp, np.asarray(threshold), width, resolution, self.success)

    @property
    def cautious(self) -> "DiscrepancySurrogate":
        """The surrogate to which doubt beyond what the threshold can resolve is no agreement."""
        mean, _ = self.predict(self.gp.data.u)
        noise = self.scale.spread * float(np.exp(self.gp.hyper.log_noise[0]))
        scales = float(np.hypot(noise, self.width)), self.threshold - float(mean.min())
        return replace(self, resolution=max(*scales, MIN_RESOLUTION * self.scale.spread))

    @property
    def sure(self) -> ThresholdState:
        return self.state._replace(doubt=np.zeros(()))

    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new g(Delta), its noise included, at quantiles u [n, d]: [n], [n]."""
        (mean,), (variance,) = predict(self.gp, u)
        sd = np.sqrt(variance + np.exp(2.0 * self.gp.hyper.log_noise[0]))
        return self.scale.location + self.scale.spread * mean, self.scale.spread * sd

    def predicted(self, features: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """g(Delta) [n], capped at the worst run that was learned from."""
        return self.transform(np.minimum(discrepancy, self.discrepancy.max()))

    def minimum(self) -> np.ndarray:
        """Where the discrepancy is surely low, u [d]."""
        return surely_least(self.gp)

    def fantasize(self, u: np.ndarray) -> "DiscrepancySurrogate":
        """Condition on the predicted means at u [n, d], for points still being simulated."""
        return replace(self, gp=fantasize(self.gp, u)) if len(u) else self

    def constants(self) -> dict[str, np.ndarray]:
        """The threshold, on the scale of g(Delta)."""
        return {"threshold": np.asarray(self.threshold)}

    def described(self) -> list[str]:
        """The threshold, on the scale of the discrepancy."""
        return [f"threshold {float(self.transform.inverse(np.asarray(self.threshold))):.3g}"]

    def checks(self) -> dict[str, np.ndarray]:
        """Studentised leave-one-out errors `loo_z` [n, 1]."""
        return {"loo_z": leave_one_out_errors(self.gp, len(self.discrepancy))}

    @property
    def fits(self) -> bool:
        """Whether discrepancies as low as the threshold can be expected anywhere."""
        mean, sd = self.predict(self.gp.data.u)
        low = LOW * np.hypot(sd, self.width)
        return self.equal or bool((self.threshold > mean - low).any())

    def warnings(self, *, confirmed: bool = False) -> list[str]:
        """Warnings of the process's errors, unless it is confirmed, and of what was compared."""
        if self.equal:
            return [EQUAL]
        said = [*self.said]
        if not confirmed:
            said += complaints(self.checks()["loo_z"], "discrepancy")
        if self.noisy:
            said.append(NOISY)
        return said if self.fits else [*said, LOW_THRESHOLD]

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
    normal: np.ndarray | None = None,
) -> DiscrepancySurrogate:
    """Fit the surrogate.

    A run that blew up is learned as the worst of the others: the process need not follow it, but
    shall know that it is bad there. Of the transforms identity, sqrt and log the one with the
    highest leave-one-out log predictive density of the discrepancy itself (Jacobian included)
    is taken, unless given. The threshold is that of the default rule, see `with_threshold`.

    Args:
        u: Prior quantiles [n, d].
        discrepancy: Finite values [n], n >= 2.
        transform: A name, or None to choose.
        previous: Learned from the first of these data; its hyperparameters are kept until the
            data have grown by GROWTH, its transform until they have by TRANSFORM_GROWTH.
        normal: Which parameters the kernel sees as normal scores [d], see `gp.process.coordinates`.

    Raises:
        ValueError: bad transform.
    """
    values = np.minimum(discrepancy, discrepancy[~is_outlier(discrepancy)].max())
    n = len(u)
    with np.errstate(divide="ignore", invalid="ignore"):  # where the transform is undefined
        old = previous is not None and np.isfinite(previous.scale(values)).all()
    if (
        previous is not None
        and old
        and not previous.equal
        and n < TRANSFORM_GROWTH * previous.chosen_at
    ):
        data = Data(u, previous.scale(values)[None], normal)
        hyper, learned_at = previous.gp.hyper, previous.learned_at
        if n >= GROWTH * learned_at:
            hyper, learned_at = maximum_a_posteriori(data, hyper), n
        learned = DiscrepancySurrogate(
            condition(hyper, data), previous.scale, values, np.nan, learned_at, previous.chosen_at
        )
        return with_threshold(learned, None)
    options = [_standardise(option, values) for option in candidates(transform, values)]
    fitted = [_fit(Data(u, scale(values)[None], normal)) for scale in options]
    scores = [_score(gp, scale, values) for gp, scale in zip(fitted, options, strict=True)]
    best = int(np.argmax(scores))
    chosen = DiscrepancySurrogate(fitted[best], options[best], values, np.nan, n, n)
    return with_threshold(chosen, None)


def is_outlier(discrepancy: np.ndarray) -> np.ndarray:
    """Which of the discrepancies [n] are absurdly larger than the best quarter, bool [n]; NaN is
    not. Most runs may have blown up, or hold a number such as 1e16 in place of infinity."""
    deviation = discrepancy - np.nanmin(discrepancy, initial=np.inf)
    finite = deviation[np.isfinite(deviation)]
    spread = np.quantile(finite, BEST_SHARE) if finite.size else 0.0
    return (deviation / MAX_DEVIATIONS > spread) & (spread != 0.0)


def _fit(data: Data) -> GP:
    return condition(maximum_a_posteriori(data), data)


def with_threshold(learned: DiscrepancySurrogate, rule: Threshold) -> DiscrepancySurrogate:
    """The surrogate with the threshold that a rule chooses, see `threshold.choose_threshold`.

    Raises:
        ValueError: the transform is undefined at the given threshold.
    """

    def at_minimum() -> tuple[float, float]:
        mean, sd = learned.predict(learned.gp.data.u)
        best = np.argmin(mean)
        return float(mean[best]), float(sd[best])

    if rule is None or isinstance(rule, Matched):
        d = learned.gp.data.u.shape[1]
        matching = Matched(d + UNKNOWN_FREEDOM) if rule is None else rule
        least = at_minimum()
        mean, sd = (float(part[0]) for part in learned.predict(learned.minimum()[None]))
        # between the runs the least may be lower, but not out of all proportion
        if learned.transform.inverse(np.asarray(mean)) > BETWEEN * learned.discrepancy.min():
            least = min(least, (mean, sd))
        threshold, width = matched(matching, *least, learned.transform, d)
        return replace(learned, threshold=threshold, width=width, noisy=width == 0.0)
    threshold = choose_threshold(rule, learned.discrepancy, learned.transform, at_minimum)
    return replace(learned, threshold=threshold, width=0.0, noisy=False)


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
    mean, variance = (moment[0] for moment in leave_one_out(gp))
    residual = gp.data.y[0] - mean
    density = -0.5 * (residual**2 / variance + np.log(2.0 * np.pi * variance))
    jacobian = scale.transform.log_jacobian(values) - np.log(scale.spread)
    return float(np.sum((density + jacobian)[values <= np.median(values)]))
