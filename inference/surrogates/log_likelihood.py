"""A Gaussian process of the log likelihood, where a simulator or a table of losses has it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from .._float64 import in_float64
from ..gp.hyperparameters import GROWTH, maximum_a_posteriori
from ..gp.namespaces import namespace
from ..gp.optimise import minimise_in_box
from ..gp.process import (
    GP,
    Data,
    believe,
    condition,
    leave_one_out,
    padded,
    padded_rows,
    predict,
    predict_points,
)
from ..sampling.importance import explore
from ..sampling.target import Target
from ..simulations.failures import impossible, incomparable, not_finite
from ..types import LogLikelihood, LogSecondMoment
from .base import Learnable, Measured
from .success import learn_success, log_success, padded_success, sane
from .warnings import EQUAL, UNCERTAIN, complaints

LINEAR = 40.0  # nats below the best, from where on depth counts by its logarithm
MAX_FOLDS = 30.0  # powers of e by which a predicted depth may exceed LINEAR: overflow
MIN_SD_SHARE = 0.05  # of the usual sd that is given, below which noise is not believed
MAX_RISE = 10.0  # nats above the best value, which a fit may predict
OPTIMISM = 2.0  # sds, of a search: where a run was unlucky others are to be made
UPPER_QUARTILE = float(ndtri(0.75))
MAX_SD = 1.5  # of a log likelihood that is known, in nats
MAX_UNCERTAIN_SHARE = 0.2  # of what may be the posterior, from which a fit warns


class LevelState(NamedTuple):
    """What the likelihood depends on; the process is one of (compressed depth - location) / spread.

    A fit takes the harmonic mean of what the likelihood may be, a search the bound that lies
    `optimism` sds above its median.
    """

    gp: GP
    top: np.ndarray  # [], the best log likelihood
    location: np.ndarray  # []
    spread: np.ndarray  # [], in nats near the top
    success: GP | None = None  # see `success.learn_success`
    doubt: np.ndarray = np.ones(())  # the part of the latent variance that counts against a place
    optimism: np.ndarray = np.zeros(())

    def padded(self) -> "LevelState":
        """The same likelihood in arrays of few shapes."""
        success = padded_success(self.success)
        return self._replace(
            gp=padded(self.gp, 1, padded_rows(len(self.gp.data.u))), success=success
        )


def compressed(depth: np.ndarray) -> np.ndarray:
    """A depth below the top, in nats: itself down to LINEAR, beyond it grows as its logarithm.

    Near the top the log likelihood keeps its shape, of which a parabola is the commonest. Far below
    only that it lies far below must be right: what a process misses there by, say, a tenth of the
    depth is not to cost it the resolution above (the purpose of noise shaping, Acerbi 2020).
    """
    beyond = np.maximum(depth, LINEAR) / LINEAR
    return np.where(depth < LINEAR, depth, LINEAR * (1.0 + np.log(beyond)))


def expanded(height: Any) -> Any:
    """The inverse of `compressed`, for arrays of NumPy or JAX."""
    xp = namespace(height)
    folds = xp.clip(height / LINEAR - 1.0, 0.0, MAX_FOLDS)
    return xp.where(height < LINEAR, height, LINEAR * xp.exp(folds))


def log_likelihood(state: LevelState, u: Any) -> Any:
    """log P(success) plus the log likelihood of which the process tells, at u [n, d]: [n].

    Where its latent value has mean m and variance v, the median of the likelihood is exp(m)
    (Jarvenpaa et al. 2021), its mean exp(m + v / 2), which explodes where nothing is known, and
    its harmonic mean exp(m - v / 2): what is not known explains nothing. With `doubt` it is the
    last. None exceeds the best value by more than MAX_RISE, lest an extrapolation outweigh P.
    """
    xp = namespace(u)
    mean, variance = predict(state.gp, u)
    doubt = 0.5 * state.doubt * state.spread**2 * variance[0]
    hope = state.optimism * state.spread * xp.sqrt(variance[0])
    height = state.location + state.spread * mean[0] + doubt - hope
    return state.top - expanded(xp.maximum(height, -MAX_RISE)) + log_success(state.success, u)


def log_second_moment(state: LevelState, u: np.ndarray, spread: np.ndarray | None) -> np.ndarray:
    """log (L^2 + R^2), R the interquartile range of the likelihood: [n] or [n, ...].

    A likelihood's own second moment explodes where it is not known; its interquartile range is
    what Jarvenpaa et al. (2021) put in the variance's place.

    Args:
        spread: Variance of the latent value that varies, [n, ..., 1]; None is all of it.
    """
    mean, variance = (part[0] for part in predict(state.gp, u))
    varying = variance if spread is None else spread[..., 0]
    shape = len(u), *[1] * (varying.ndim - 1)
    height = (state.location + state.spread * mean).reshape(shape)
    reach = UPPER_QUARTILE * state.spread * np.sqrt(np.maximum(varying, 0.0))
    high, low = state.top - expanded(height - reach), state.top - expanded(height + reach)
    log_range = high + np.log(-np.expm1(-np.maximum(high - low, 1e-12)))
    log_range = log_range + log_success(state.success, u).reshape(shape)
    return np.logaddexp(2.0 * log_likelihood(state, u).reshape(shape), 2.0 * log_range)


@dataclass(frozen=True, eq=False)
class LogLikelihoodSurrogate:
    """See `learn`.

    Attributes:
        state: The process of depths, and how they become log likelihoods.
        values: Log likelihoods that were learned from [n].
        learned_at: How many were known when the hyperparameters were found.
    """

    state: LevelState
    values: np.ndarray
    learned_at: int

    @property
    def gp(self) -> GP:
        return self.state.gp

    @property
    def cautious(self) -> "LogLikelihoodSurrogate":
        """The surrogate of a fit, to which what is not known explains nothing."""
        state = self.state._replace(doubt=np.ones(()), optimism=np.zeros(()))
        return replace(self, state=state)

    @property
    def log_likelihood(self) -> LogLikelihood:
        return log_likelihood

    @property
    def log_second_moment(self) -> LogSecondMoment:
        return log_second_moment

    @in_float64
    def minimum(self) -> np.ndarray:
        """Where the log likelihood is surely high: greatest mean less sd, u [d]."""

        def surely(u: np.ndarray) -> np.ndarray:
            mean, variance = predict(self.gp, u)
            return mean[0] + np.sqrt(variance[0])

        return minimise_in_box(surely, self.gp.data.u.shape[1])

    @in_float64
    def believe(self, u: np.ndarray) -> "LogLikelihoodSurrogate":
        """Condition on the predicted means at u [n, d], for points still being simulated."""
        if not len(u):
            return self
        noise = self.gp.data.spread
        usual = None if noise is None else np.full(len(u), np.median(noise))
        return replace(self, state=self.state._replace(gp=believe(self.gp, u, usual)))

    @in_float64
    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new log likelihood, its noise included, at u [n, d]: [n], [n]."""
        mean, variance = predict_points(self.gp, u)
        height = self.state.location + self.state.spread * mean[0]
        sd = self.state.spread * np.sqrt(variance[0] + np.exp(2.0 * self.gp.hyper.log_noise[0]))
        depth = expanded(height)
        return self.state.top - depth, sd * np.maximum(depth / LINEAR, 1.0)

    def constants(self) -> dict[str, np.ndarray]:
        """The best log likelihood, and the sd of one estimate's noise near it, in nats."""
        noise = self.state.spread * np.exp(self.gp.hyper.log_noise[0])
        return {"best_log_likelihood": self.state.top, "noise": noise}

    def described(self) -> list[str]:
        """The noise of a log likelihood near the best one."""
        return [f"noise {float(self.constants()['noise']):.2g} nats"]

    @in_float64
    def checks(self) -> dict[str, np.ndarray]:
        """Studentised leave-one-out errors `loo_z` [n, 1] of the compressed depths."""
        mean, variance = leave_one_out(self.gp)
        error = (self.gp.data.y - mean) / np.sqrt(variance)
        return {"loo_z": error[0, : len(self.values), None]}

    @property
    def fits(self) -> bool:
        """Always: no data are compared here."""
        return True

    @in_float64
    def warnings(self, *, confirmed: bool = False) -> list[str]:
        """What the leave-one-out errors complain of, of depths that count, unless confirmed; and
        that much of what may be the posterior lies where the log likelihood is hardly known."""
        if np.ptp(self.values) <= 1e-12 * np.abs(self.values).max():
            return [EQUAL]
        near = self.values > self.values.max() - LINEAR
        said = [] if confirmed else complaints(self.checks()["loo_z"][near], "log likelihood")
        return [*said, UNCERTAIN] if self._uncertain() > MAX_UNCERTAIN_SHARE else said

    def _uncertain(self) -> float:
        """Share of the median likelihood's posterior where its log is not known to MAX_SD."""
        median = self.state._replace(doubt=np.zeros(()), optimism=np.zeros(()))
        target = Target(log_likelihood, median, self.gp.data.u.shape[1])
        population = explore(np.random.default_rng(0), target)
        weights = np.exp(population.log_weights - population.log_weights.max())
        sd = self.state.spread * np.sqrt(predict(self.gp, ndtr(population.x))[1][0])
        return float(weights @ (sd > MAX_SD) / weights.sum())

    @in_float64
    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new log likelihood for each row of u [n, d]."""
        mean, sd = self.predict(u)
        return {"log_likelihood": mean + sd * rng.normal(size=mean.shape)}


@in_float64
def learn(
    u: np.ndarray,
    values: np.ndarray,
    sd: np.ndarray,
    previous: LogLikelihoodSurrogate | None = None,
    normal: np.ndarray | None = None,
) -> LogLikelihoodSurrogate:
    """Fit the surrogate: a process of how far log likelihoods lie below the best one.

    Args:
        u: Prior quantiles [n, d].
        values: Log likelihoods [n], finite.
        sd: Of their noise [n], NaN where it is not known; known ones tell how it varies, their
            common size is learned.
        previous: Learned from the first of these data; its hyperparameters and scale are kept
            until the data have grown by GROWTH, or a value is better than its best by LINEAR.
        normal: Which parameters the kernel sees as normal scores [d], see `gp.process.coordinates`.
    """
    n, best = len(u), values.max()
    kept = previous if previous and n < GROWTH * previous.learned_at else None
    if kept is not None and best > kept.state.top + LINEAR:
        kept = None
    depth = best - values if kept is None else kept.state.top - values
    heights = compressed(depth)
    if kept is None:
        top, location, spread = best, heights.mean(), heights.std() or 1.0
    else:
        top, location, spread = kept.state.top, kept.state.location, kept.state.spread
    data = Data(u, ((heights - location) / spread)[None], normal, _relative_noise(sd, depth))
    hyper = maximum_a_posteriori(data) if kept is None else kept.gp.hyper
    state = LevelState(
        condition(hyper, data),
        np.asarray(top),
        np.asarray(location),
        np.asarray(spread),
        doubt=np.zeros(()),
        optimism=np.asarray(OPTIMISM),
    )
    return LogLikelihoodSurrogate(state, values, n if kept is None else kept.learned_at)


def _relative_noise(sd: np.ndarray, depth: np.ndarray) -> np.ndarray | None:
    """Noise variances of compressed depths over the usual one [n]; None where no sd is known."""
    usual = np.nanmedian(sd) if np.isfinite(sd).any() else 0.0
    if usual == 0.0:
        return None
    share = np.maximum(np.where(np.isfinite(sd), sd / usual, 1.0), MIN_SD_SHARE)
    return (share * LINEAR / np.maximum(depth, LINEAR)) ** 2


@dataclass(frozen=True)
class LogLikelihoodFamily:
    """A Gaussian process on the log likelihood that the simulator itself returns.

    A simulator returns a number, or two of which the second is the sd of the first one's noise.
    -inf is where the data are impossible. Nothing is observed beside.
    """

    name: ClassVar[str] = "log_likelihood"
    acquisition: ClassVar[str] = "draws"
    replicates: ClassVar[bool] = False

    def learner(self, observed: np.ndarray) -> "LogLikelihoodLearner":
        return LogLikelihoodLearner()


@dataclass(frozen=True)
class LogLikelihoodLearner:
    """Log likelihoods are learned from as they are; the discrepancy is minus one."""

    features: ClassVar[int] = 1  # the sd of the noise, NaN where none is given
    any_shape: ClassVar[bool] = True

    def measure(self, signals: Sequence[np.ndarray | None]) -> Measured:
        """Sds [n, 1] and minus the log likelihoods of n signals, None where a run failed."""
        found, errors = np.full((len(signals), 2), np.nan), [""] * len(signals)
        for i, signal in enumerate(signals):
            if signal is None or (signal.size and np.isnan(signal).all()):
                continue
            errors[i] = _unlikely(signal)
            if not errors[i]:
                found[i, : signal.size] = signal.ravel()
        return Measured(found[:, 1:], -found[:, 0], errors)

    def learnable(self, discrepancy: np.ndarray) -> np.ndarray:
        """Which of the successful simulations are learned from, bool [n]: what blew up is not."""
        return sane(discrepancy)

    def learn(
        self, known: Learnable, previous: LogLikelihoodSurrogate | None
    ) -> LogLikelihoodSurrogate:
        """To search with: where a run was unlucky others are to be made."""
        kept = self.learnable(known.discrepancy)
        values, sd = -known.discrepancy[kept], known.features[kept, 0]
        learned = learn(known.u[kept], values, sd, previous, known.normal)
        success = learn_success(known.runs, known.normal)
        return replace(learned, state=learned.state._replace(success=success))

    def finish(self, known: Learnable, seed: int) -> LogLikelihoodSurrogate:
        """The surrogate on which a fit rests."""
        return self.learn(known, None).cautious


def _unlikely(signal: np.ndarray) -> str:
    """Why a signal is no log likelihood of data that are possible; "" if it is one."""
    if not 1 <= signal.size <= 2:
        return incomparable(
            f"a log likelihood is one number, or two with its sd, got a signal of {signal.shape}"
        )
    value, *sd = signal.ravel()
    if value == -np.inf:
        return impossible("the log likelihood is -inf")
    if not np.isfinite(value) or not all(0.0 <= one < np.inf for one in sd):
        return not_finite(f"the log likelihood, or its sd: {signal.ravel()}")
    return ""
