"""The paper's surrogate: a Gaussian process on the (transformed) discrepancy."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from .._float64 import in_float64
from ..gp.hyperparameters import GROWTH, maximum_a_posteriori
from ..gp.namespaces import log_sum_exp
from ..gp.optimise import minimise_in_box
from ..gp.process import (
    GP,
    Data,
    Hyper,
    believe,
    condition,
    leave_one_out,
    predict,
    predict_points,
)
from ..sampling.importance import explore
from ..sampling.target import Target
from ..types import LogLikelihood, LogSecondMoment
from .hyper_draws import posterior_draws
from .outliers import sane
from .success import log_success
from .threshold import (
    Threshold,
    ThresholdState,
    choose_threshold,
    log_likelihood,
    log_likelihoods,
    log_second_moment,
)
from .transform import Transform, candidates
from .warnings import EQUAL, LOW_THRESHOLD, complaints

LOW = 3.0  # sds of a new discrepancy by which a threshold lies too low
TRANSFORM_GROWTH = 2.0  # the transform is chosen anew when data have grown by this factor


class Scale(NamedTuple):
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
        gp: The conditioned process; one for each draw of the hyperparameters, or one.
        scale: g, and the standardisation of g(Delta).
        discrepancy: What was learned from [n].
        threshold: eps on the scale of g(Delta).
        learned_at: Simulations known when the hyperparameters were found.
        chosen_at: Simulations known when the transform was chosen.
        success: Where runs succeed, see `success.learn_success`.
        displaced: Over which the likelihood is averaged, see `averaged`; None for `gp` alone.
    """

    gp: GP
    scale: Scale
    discrepancy: np.ndarray
    threshold: float
    learned_at: int
    chosen_at: int
    success: GP | None = None
    displaced: ThresholdState | None = None

    @property
    def equal(self) -> bool:
        """Whether all discrepancies are the same, but for rounding."""
        return bool(np.ptp(self.scale(self.discrepancy)) < 0.5)  # of what has an sd of 1

    @property
    def transform(self) -> Transform:
        return self.scale.transform

    @property
    @in_float64
    def state(self) -> ThresholdState:
        if self.displaced is not None:
            return self.displaced._replace(success=self.success)
        threshold = (self.threshold - self.scale.location) / self.scale.spread
        return ThresholdState(self.gp, np.asarray(threshold), self.success)

    @property
    def log_likelihood(self) -> LogLikelihood:
        return log_likelihood

    @property
    def log_second_moment(self) -> LogSecondMoment:
        return log_second_moment

    @in_float64
    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new g(Delta), its noise included, at quantiles u [n, d]: [n], [n]."""
        mean, variance = predict_points(self.gp, u)
        noisy = variance + np.exp(2.0 * self.gp.hyper.log_noise)[:, None]
        centre = mean.mean(0)
        sd = np.sqrt(noisy.mean(0) + mean.var(0))
        return self.scale.location + self.scale.spread * centre, self.scale.spread * sd

    @in_float64
    def minimum(self) -> np.ndarray:
        """Where the mean is surely low: minimiser of mean + sd over the box, u [d].

        The mean alone may be least in a corner where nothing was simulated.
        """

        def surely(u: np.ndarray) -> np.ndarray:
            mean, variance = predict(self.gp, u)
            return np.mean(mean + np.sqrt(variance), axis=0)

        return minimise_in_box(surely, self.gp.data.u.shape[1])

    @in_float64
    def believe(self, u: np.ndarray) -> "DiscrepancySurrogate":
        """Condition on the predicted means at u [n, d], for points still being simulated."""
        return replace(self, gp=believe(self.gp, u)) if len(u) else self

    def constants(self) -> dict[str, np.ndarray]:
        """What a reader of the posterior must know of the likelihood."""
        return {"threshold": np.asarray(self.threshold)}

    @in_float64
    def checks(self) -> dict[str, np.ndarray]:
        """Studentised leave-one-out errors `loo_z` [n, 1]."""
        mean, variance = leave_one_out(self.gp)
        error = self.gp.data.y[0] - mean.mean(0)
        total = variance.mean(0) + mean.var(0)  # of the mixture over hyperparameters
        return {"loo_z": (error / np.sqrt(total))[: len(self.discrepancy), None]}

    def warnings(self) -> list[str]:
        """What the leave-one-out errors complain of."""
        if self.equal:
            return [EQUAL]
        said = complaints(self.checks()["loo_z"], "discrepancy")
        mean, sd = self.predict(self.gp.data.u)
        return [*said, LOW_THRESHOLD] if (self.threshold < mean - LOW * sd).all() else said

    @in_float64
    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new discrepancy for each row of u [n, d]."""
        mean, sd = self.predict(u)
        drawn = mean + sd * rng.normal(size=mean.shape)
        return {"discrepancy": self.transform.inverse(drawn)}


@in_float64
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
    values = np.minimum(discrepancy, discrepancy[sane(discrepancy)].max())
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


def _fit(data: Data) -> GP:
    return condition(maximum_a_posteriori(data), data)


@in_float64
def with_threshold(learned: DiscrepancySurrogate, rule: Threshold) -> DiscrepancySurrogate:
    """The surrogate with the threshold that a rule chooses, see `threshold.choose_threshold`.

    Raises:
        ValueError: the transform is undefined at the given threshold.
    """

    def at_minimum() -> tuple[float, float]:
        mean, sd = learned.predict(learned.gp.data.u)
        best = np.argmin(mean)
        return float(mean[best]), float(sd[best])

    threshold = choose_threshold(rule, learned.discrepancy, learned.transform, at_minimum)
    return replace(learned, threshold=threshold)


@in_float64
def marginalised(
    surrogate: DiscrepancySurrogate, rule: Threshold, draws: int, seed: int
) -> DiscrepancySurrogate:
    """The surrogate with one process for each of `draws` posterior draws of the hyperparameters."""
    hyper = posterior_draws(surrogate.gp.data, draws, seed)
    data = surrogate.gp.data
    spread = data._replace(y=np.tile(data.y, (draws, 1)))
    return with_threshold(replace(surrogate, gp=condition(hyper, spread)), rule)


@in_float64
def averaged(
    surrogate: DiscrepancySurrogate, displaced: np.ndarray, rule: Threshold
) -> DiscrepancySurrogate:
    """The surrogate whose posterior is a mean over draws of an error between simulator and data.

    Had the data been without the error, they would be observed less one of its draws: for each,
    the runs' discrepancies from that are learned, and have a threshold of their own. So a best
    fit is as uncertain as the error moves it; an error that is added to discrepancies would only
    make all of them larger. Each draw counts alike: its likelihood is divided by its integral.

    Args:
        displaced: Discrepancies of the runs from observed less each draw, [n, k]; draws with one
            that the transform does not know are left out.
        rule: Of the thresholds.
    """
    y = surrogate.scale(displaced.T)
    known = np.isfinite(y).all(1)
    if not known.any():
        return surrogate
    base, count = surrogate.gp, int(known.sum())
    hyper = Hyper(*(np.resize(part, (count, *part.shape[1:])) for part in base.hyper))
    gp = condition(hyper, base.data._replace(y=y[known]))
    singles = [
        replace(surrogate, gp=gp.only(slice(k, k + 1)), discrepancy=values)
        for k, values in enumerate(displaced.T[known])
    ]
    thresholds = np.array([with_threshold(one, rule).threshold for one in singles])
    standard = (thresholds - surrogate.scale.location) / surrogate.scale.spread
    state = ThresholdState(gp, standard, surrogate.success)
    return replace(surrogate, displaced=state._replace(log_area=_log_areas(state)))


def _log_areas(state: ThresholdState) -> np.ndarray:
    """Log integrals [k] of the processes' likelihoods over the prior, up to one constant."""
    target = Target(log_likelihood, state, state.gp.data.u.shape[1])
    population = explore(np.random.default_rng(0), target)
    u = ndtr(population.x)
    weights = population.log_weights - log_likelihood(state, u)
    terms = (
        log_likelihoods(state._replace(success=None), u) + log_success(state.success, u)[:, None]
    )
    terms = np.where(np.isfinite(weights)[:, None], terms + weights[:, None], -np.inf)
    areas = log_sum_exp(terms.T)
    return areas - areas.max()


def _standardise(transform: Transform, values: np.ndarray) -> Scale:
    transformed = transform(values)
    size = float(np.abs(transformed).max())
    with np.errstate(over="ignore"):
        spread, rounding = float(transformed.std()), 1e-12 * size
    if not np.isfinite(spread):  # the squares of large numbers overflow
        spread = size * float((transformed / size).std())
    # all equal: nothing to standardise
    return Scale(transform, float(transformed.mean()), spread if spread > rounding else 1.0)


def _score(gp: GP, scale: Scale, values: np.ndarray) -> float:
    """Leave-one-out log predictive density of the discrepancy under the scale, summed."""
    mean, variance = (moment[0] for moment in leave_one_out(gp))
    residual = gp.data.y[0] - mean
    density = -0.5 * np.sum(residual**2 / variance + np.log(2.0 * np.pi * variance))
    jacobian = scale.transform.log_jacobian(values) - np.log(scale.spread)
    return float(density + np.sum(jacobian))
