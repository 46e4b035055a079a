"""A Gaussian process of the log likelihood, where a simulator or a table of losses has it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from ..gp.hyperparameters import GROWTH, maximum_a_posteriori
from ..gp.namespaces import namespace
from ..gp.process import GP, Data, condition, leave_one_out_log_densities, predict
from ..sampling.importance import explore
from ..sampling.target import Target
from ..simulations.failures import Failure, impossible, incomparable, not_finite
from .base import Family, Measured, TrainingData
from .processes import OfOneProcess, learn_success, log_success
from .warnings import EQUAL, UNCERTAIN, complaints

NEAR = 40.0  # nats below the best, down to which a log likelihood must be right
LINEAR = (NEAR, 1e3, 1e9)  # nats below the best, from where on depth may count by its logarithm
MAX_FOLDS = 30.0  # powers of e by which a predicted depth may exceed these: overflow
MIN_SD_SHARE = 0.05  # of the usual sd that is given, below which noise is not believed
MAX_RISE = 10.0  # nats above the best value, beyond which a prediction is an extrapolation
OPTIMISM = 2.0  # sds, of a search: where a run was unlucky others are to be made
UPPER_QUARTILE = float(ndtri(0.75))
MAX_SD = 1.5  # of a log likelihood that is known, in nats
MAX_UNCERTAIN_SHARE = 0.2  # of what may be the posterior, from which a fit warns


class LogLikelihoodScale(NamedTuple):
    """From log likelihoods to the process's targets: (compressed depth - location) / spread.

    A depth below the top, in nats, is itself down to `linear`; beyond it grows as its logarithm.
    Near the top the log likelihood keeps its shape, of which a parabola is the commonest. Far below
    only that it lies far below must be right: what a process misses there by, say, a tenth of the
    depth is not to cost it the resolution above (the purpose of noise shaping, Acerbi 2020).
    """

    top: np.ndarray  # [], the best log likelihood
    linear: np.ndarray  # [], one of LINEAR
    location: np.ndarray  # []
    spread: np.ndarray  # [], in nats near the top

    def targets(self, values: np.ndarray) -> np.ndarray:
        return (compressed(self.top - values, self.linear) - self.location) / self.spread

    def values(self, latent: Any) -> Any:
        return self.top - expanded(self.location + self.spread * latent, self.linear)

    def folds(self, values: np.ndarray) -> np.ndarray:
        """Factors by which nats at these log likelihoods are compressed, 1 near the top."""
        return np.maximum((self.top - values) / self.linear, 1.0)


def compressed(depth: np.ndarray, linear: float | np.ndarray) -> np.ndarray:
    beyond = np.maximum(depth, linear) / linear
    return np.where(depth < linear, depth, linear * (1.0 + np.log(beyond)))


def expanded(height: Any, linear: float | np.ndarray) -> Any:
    """The inverse of `compressed`, for arrays of NumPy or JAX."""
    xp = namespace(height)
    folds = xp.clip(height / linear - 1.0, 0.0, MAX_FOLDS)
    return xp.where(height < linear, height, linear * xp.exp(folds))


class LevelLikelihood(NamedTuple):
    """The likelihood: for a fit the harmonic mean of what it may be, for a search the bound that
    lies `optimism` sds above its median.
    """

    gp: GP
    scale: LogLikelihoodScale
    success: GP | None = None  # see `processes.learn_success`
    doubt: np.ndarray = np.ones(())  # the part of the latent variance that counts against a place
    optimism: np.ndarray = np.zeros(())
    rise: np.ndarray = np.full((), MAX_RISE)  # nats above the best value that count at most

    def __call__(self, u: Any) -> Any:
        """log P(success) plus the log likelihood of which the process tells, at u [n, d]: [n].

        Where its latent value has mean m and variance v, the median of the likelihood is exp(m)
        (Jarvenpaa et al. 2021), its mean exp(m + v / 2), which explodes where nothing is known, and
        its harmonic mean exp(m - v / 2): what is not known explains nothing. With `doubt` it is the
        last.
        """
        xp = namespace(u)
        mean, variance = predict(self.gp, u)
        doubt = 0.5 * self.doubt * self.scale.spread * variance[0]
        latent = mean[0] + doubt - self.optimism * xp.sqrt(variance[0])
        return self._values(latent) + log_success(self.success, u)

    def _values(self, latent: Any) -> Any:
        return namespace(latent).minimum(self.scale.values(latent), self.scale.top + self.rise)

    def known(self, u: np.ndarray, latent: np.ndarray) -> np.ndarray:
        """The log likelihood [n], were the targets at u [n, d] latent [1, n]."""
        return self._values(latent[0]) + log_success(self.success, u)

    def second_moment(self, u: np.ndarray, spread: np.ndarray | None) -> np.ndarray:
        """log (L^2 + R^2), R the interquartile range of the likelihood: [n] or [n, ...].

        A likelihood's own second moment explodes where it is not known; its interquartile range is
        what Jarvenpaa et al. (2021) put in the variance's place.

        Args:
            spread: Variance of the latent value that varies, [n, ..., 1]; None is all of it.
        """
        mean, variance = (part[0] for part in predict(self.gp, u))
        varying = variance if spread is None else spread[..., 0]
        shape = len(u), *[1] * (varying.ndim - 1)
        mean, reach = mean.reshape(shape), UPPER_QUARTILE * np.sqrt(np.maximum(varying, 0.0))
        high, low = self._values(mean - reach), self._values(mean + reach)
        log_range = high + np.log(-np.expm1(-np.maximum(high - low, 1e-12)))
        log_range = log_range + log_success(self.success, u).reshape(shape)
        return np.logaddexp(2.0 * self(u).reshape(shape), 2.0 * log_range)


@dataclass(frozen=True, eq=False)
class LogLikelihoodSurrogate(OfOneProcess):
    """A process of how far log likelihoods lie below the best one.

    Attributes:
        values: The log likelihoods.
        scale: How depths become log likelihoods.
        hopeful: Whether it is to search with, and what is not known attracts runs.
    """

    scale: LogLikelihoodScale
    hopeful: bool = True

    @cached_property
    def log_likelihood(self) -> LevelLikelihood:  # pyright: ignore  nobody sets it
        state = LevelLikelihood(self.gp, self.scale, self.success)
        if self.hopeful:
            return state._replace(doubt=np.zeros(()), optimism=np.asarray(OPTIMISM))
        # where runs failed, what is extrapolated beyond their border must not outweigh
        # log P(success)
        return state._replace(rise=np.full((), np.inf)) if self.success is None else state

    @property
    def cautious(self) -> "LogLikelihoodSurrogate":
        """The surrogate of a fit, to which what is not known explains nothing."""
        return replace(self, hopeful=False)

    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new log likelihood, its noise included, at u [n, d]: [n], [n]."""
        mean, sd = self.new_target(u)
        values = self.scale.values(mean)
        return values, self.scale.spread * self.scale.folds(values) * sd

    def predicted(self, features: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """The log likelihoods [n]."""
        return -discrepancy

    def constants(self) -> dict[str, np.ndarray]:
        """The best log likelihood, and the sd of one estimate's noise near it, in nats."""
        noise = self.scale.spread * np.exp(self.gp.hyper.log_noise[0])
        return {"best_log_likelihood": self.scale.top, "noise": noise}

    def described(self) -> list[str]:
        """The noise of a log likelihood near the best one."""
        return [f"noise {float(self.constants()['noise']):.2g} nats"]

    def warnings(self, *, confirmed: bool = False) -> list[str]:
        """Warnings of the leave-one-out errors at depths that count, unless confirmed; and
        that much of what may be the posterior lies where the log likelihood is hardly known."""
        if np.ptp(self.values) <= 1e-12 * np.abs(self.values).max():
            return [EQUAL]
        near = self.values > self.values.max() - NEAR
        said = [] if confirmed else complaints(self.checks()["loo_z"][near], "log likelihood")
        return [*said, UNCERTAIN] if self._uncertain() > MAX_UNCERTAIN_SHARE else said

    def _uncertain(self) -> float:
        """Share of the median likelihood's posterior where its log is not known to MAX_SD, or
        exceeds the best value by MAX_RISE."""
        median = self.log_likelihood._replace(doubt=np.zeros(()), optimism=np.zeros(()))
        target = Target(median, self.u.shape[1])
        population = explore(np.random.default_rng(0), target)
        mean, variance = (part[0] for part in predict(self.gp, ndtr(population.x)))
        unknown = self.scale.spread * np.sqrt(variance) > MAX_SD
        extrapolated = self.scale.values(mean) > self.scale.top + MAX_RISE
        return float(population.weights @ (unknown | extrapolated))

    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new log likelihood for each row of u [n, d]."""
        mean, sd = self.predict(u)
        return {"log_likelihood": mean + sd * rng.normal(size=mean.shape)}


def _scales(values: np.ndarray) -> list[LogLikelihoodScale]:
    """Those that differ for these log likelihoods."""
    depth, found = values.max() - values, []
    for linear in LINEAR:
        heights = compressed(depth, linear)
        top, location = np.asarray(values.max()), np.asarray(heights.mean())
        spread = np.asarray(heights.std() or 1.0)
        found.append(LogLikelihoodScale(top, np.asarray(linear), location, spread))
        if depth.max() < linear:
            break
    return found


def _score(gp: GP, scale: LogLikelihoodScale, values: np.ndarray) -> float:
    """Leave-one-out log predictive density of the log likelihoods that count, or of the best
    quarter, in nats."""
    (density,) = leave_one_out_log_densities(gp)
    near = values >= min(values.max() - NEAR, np.quantile(values, 0.75))
    return float(np.sum((density - np.log(scale.spread * scale.folds(values)))[near]))


def _targets(data: TrainingData, scale: LogLikelihoodScale) -> Data:
    """Targets of the process; where some sds are known, its noise varies as they do, and their
    common size is learned."""
    values, sd = -data.discrepancy, data.features[:, 0]
    usual = np.nanmedian(sd) if np.isfinite(sd).any() else 0.0
    noise = None
    if usual > 0.0:
        share = np.maximum(np.where(np.isfinite(sd), sd / usual, 1.0), MIN_SD_SHARE)
        noise = (share / scale.folds(values)) ** 2
    return Data(data.u, scale.targets(values)[None], data.tails, noise)


@dataclass(frozen=True)
class LogLikelihoodFamily(Family):
    """A Gaussian process on the log likelihood that the simulator itself returns.

    A simulator returns a number, or two of which the second is the sd of the first one's noise.
    -inf is where the data are impossible. Nothing is observed beside.
    """

    name: ClassVar[str] = "log_likelihood"

    @property
    def any_shape(self) -> bool:
        return True

    def observe(self, observed: ArrayLike | None) -> np.ndarray:
        """NaN: the simulator compares with the data itself."""
        if observed is None:
            return np.array(np.nan)
        raise ValueError(
            'surrogate="log_likelihood" takes no observed: the simulator compares with the data '
            f"itself, and returns the log likelihood; leave it out, got {observed!r:.100}"
        )

    def measure(self, observed: np.ndarray, signals: Sequence[np.ndarray | None]) -> Measured:
        """Sds of the noise [n, 1], NaN where none is given, and minus the log likelihoods."""
        found = np.full((len(signals), 2), np.nan)
        errors: list[Failure | None] = [None] * len(signals)
        for i, signal in enumerate(signals):
            if signal is None or (signal.size and np.isnan(signal).all()):
                continue
            errors[i] = _unlikely(signal)
            if not errors[i]:
                found[i, : signal.size] = signal.ravel()
        return Measured(found[:, 1:], -found[:, 0], errors)

    def search(
        self, data: TrainingData, key: np.ndarray, previous: LogLikelihoodSurrogate | None
    ) -> LogLikelihoodSurrogate:
        """Optimistic: where a run was unlucky others are to be made.

        Hyperparameters and scale of `previous` are kept until the data have grown by GROWTH, or a
        value is better than its best by NEAR.
        """
        values, n = -data.discrepancy, len(data.u)
        kept = previous if previous and n < GROWTH * previous.learned_at else None
        if kept is not None and values.max() < kept.scale.top + NEAR:
            gp, scale = condition(kept.gp.hyper, _targets(data, kept.scale)), kept.scale
            n = kept.learned_at
        else:
            fitted = []
            for scale in _scales(values):
                targets = _targets(data, scale)
                fitted.append((condition(maximum_a_posteriori(targets), targets), scale))
            gp, scale = max(fitted, key=lambda one: _score(one[0], one[1], values))
        success = learn_success(data.runs, data.tails)
        return LogLikelihoodSurrogate(gp, values, n, scale, success=success)

    def learn(self, data: TrainingData, key: np.ndarray) -> LogLikelihoodSurrogate:
        return self.search(data, key, None).cautious


def _unlikely(signal: np.ndarray) -> Failure | None:
    """Why a signal is no log likelihood of data that are possible; None if it is one."""
    if not 1 <= signal.size <= 2:
        return incomparable(
            f"a log likelihood is one number, or two with its sd, got a signal of {signal.shape}"
        )
    value, *sd = signal.ravel()
    if value == -np.inf:
        return impossible("the log likelihood is -inf")
    if not np.isfinite(value) or not all(0.0 <= one < np.inf for one in sd):
        return not_finite(f"a log likelihood, or its sd, which is from 0: {signal.ravel()}")
    return None
