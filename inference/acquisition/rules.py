"""Acquisition rules: where to simulate next.

Every rule scores in logs, so that nothing underflows far from the posterior, and fantasizes each
point of a batch before it chooses the next (see `fantasize` of the surrogates).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, cast

import jax
import numpy as np
from scipy.special import ndtr, ndtri, softmax

from ..arguments import check_called, checked_array, checked_number
from ..gp.namespaces import log_sum_exp
from ..gp.optimise import minimise_in_box
from ..surrogates.base import Acquisition, Family, Surrogate
from .screen import ROUNDS, screen

CANDIDATES = 128  # points among which a rule chooses
INTEGRATION_NODES = 32  # points over which a variance is integrated
MIN_EFFECTIVE = 32.0  # candidates that count, effectively
MIN_POWER = 1e-6
DIGITS, EDGE = 7, 1e-7  # of the prior quantiles that are asked, and how near the bounds


def exploration_width(t: int, dimension: int) -> float:
    """eta_t, eta_t^2 = 2 log(t^(d/2 + 2) pi^2 / (3 eps_eta)), eps_eta = 0.1, after t simulations
    (Gutmann and Corander 2016)."""
    return float(np.sqrt(2.0 * np.log(t ** (dimension / 2 + 2) * np.pi**2 / (3.0 * 0.1))))


@dataclass(frozen=True)
class LowerConfidenceBound:
    """Minimise mu - eta_t sqrt(v), then jitter (Gutmann and Corander 2016, stochastic rule).

    The jitter, a Gaussian truncated to the box, keeps points off the bounds, where the
    variance attracts the minimiser, and makes the points of a batch differ.

    Attributes:
        jitter: Its standard deviation, in prior quantiles. Of 0.03, 0.05 and 0.1 the second
            gave the best posteriors on three toys; 0.03 puts half as many points again
            within 2 % of a bound.
    """

    jitter: float = 0.05

    def __post_init__(self) -> None:
        checked_number("jitter", self.jitter, lambda sd: 0.0 < sd < np.inf, "positive")

    def __call__(self, key: jax.Array, surrogate: Any, n: int) -> np.ndarray:
        """n points u [n, d]; each is fantasized before the next is chosen.

        Args:
            key, n: See `Acquisition`.
            surrogate: Of a family that has a `lower_bound`.
        """
        rng, points = generator(key), []
        while len(points) < n:
            width = exploration_width(*surrogate.u.shape)
            bound = partial(surrogate.lower_bound, width=width)
            centre = minimise_in_box(bound, surrogate.u.shape[1])
            points.append(truncated_normal(rng, centre, self.jitter))
            if len(points) < n:
                surrogate = surrogate.fantasize(points[-1][None])
        return np.stack(points)


def generator(key: jax.Array) -> np.random.Generator:
    """NumPy's random numbers for a key: a handful needs no compilation."""
    return np.random.default_rng(np.asarray(jax.random.key_data(key)))


def truncated_normal(rng: np.random.Generator, centre: np.ndarray, sd: float) -> np.ndarray:
    """Gaussian around `centre` [d], truncated to the unit box."""
    low, high = ndtr(-centre / sd), ndtr((1.0 - centre) / sd)
    z = ndtri(low + (high - low) * rng.uniform(size=centre.shape))
    return np.clip(centre + sd * z, 1e-9, 1.0 - 1e-9)


class Candidates(NamedTuple):
    """Points that stand for the posterior, and for where it may yet lie."""

    u: np.ndarray  # [CANDIDATES, d]; the same point may appear more than once
    log_density: np.ndarray  # [CANDIDATES], of their distribution, up to a constant
    log_success: np.ndarray  # [CANDIDATES], log chance that a run succeeds


def candidates(rng: np.random.Generator, surrogate: Surrogate) -> Candidates:
    """Systematic resample, in proportion to sqrt(L) or a smaller power, of a quick screen.

    The power is halved until at least MIN_EFFECTIVE points count, however narrow the posterior.
    """
    dimension, log_likelihood = surrogate.u.shape[1], surrogate.log_likelihood
    shifts = rng.uniform(size=(ROUNDS, dimension + 1))
    found = screen(shifts, lambda u: 0.5 * np.asarray(log_likelihood(u)))
    log_target, log_weights = found.log_target, found.log_weights
    log_base = log_weights - np.where(np.isfinite(log_target), log_target, 0.0)
    power, weights = 1.0, softmax(log_weights)
    while np.sum(weights**2) > 1.0 / MIN_EFFECTIVE and power > MIN_POWER:
        power = power / 2.0
        weights = softmax(power * log_target + log_base)
    positions = (np.arange(CANDIDATES) + rng.uniform()) / CANDIDATES
    rows = np.minimum(np.searchsorted(np.cumsum(weights), positions), len(weights) - 1)
    u = found.u[rows]
    return Candidates(u, power * log_target[rows], surrogate.log_success(u))


def log_moments(surrogate: Surrogate, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log E[L] and log Var[L] at u [n, d], L being known only through the surrogate."""
    first, second = surrogate.log_likelihood(u), surrogate.log_second_moment(u)
    excess = np.maximum(second - 2.0 * first, 1e-12)
    return first, 2.0 * first + excess + np.log(-np.expm1(-excess))


class BestCandidates(ABC):
    """The candidates of highest score, each fantasized before the next is scored."""

    @abstractmethod
    def _score(
        self, rng: np.random.Generator, surrogate: Surrogate, found: Candidates
    ) -> np.ndarray:
        """Log scores [CANDIDATES]."""

    def __call__(self, key: jax.Array, surrogate: Surrogate, n: int) -> np.ndarray:
        """n different points u [n, d]; scores are lowered by the log chance that a run succeeds."""
        rng = generator(key)
        found = candidates(rng, surrogate)
        points: list[np.ndarray] = []
        while len(points) < n:
            scores = self._score(rng, surrogate, found) + found.log_success
            scores = np.where(np.isnan(scores) | _taken(found.u, points), -np.inf, scores)
            if not np.isfinite(scores).any():  # all chosen: look for others
                found = candidates(rng, surrogate)
                scores = np.where(_taken(found.u, points), -np.inf, rng.uniform(size=len(found.u)))
            points.append(found.u[np.argmax(scores)])
            if len(points) < n:
                surrogate = surrogate.fantasize(points[-1][None])
        return np.stack(points)


def _taken(u: np.ndarray, points: list[np.ndarray]) -> np.ndarray:
    """Which rows of u [n, d] are among `points`."""
    return np.any([(u == point).all(-1) for point in points] or [np.zeros(len(u), bool)], axis=0)


@dataclass(frozen=True)
class MaxVariance(BestCandidates):
    """Maximise Var[L(u)] (MaxVar, Jarvenpaa et al. 2019)."""

    def _score(
        self, rng: np.random.Generator, surrogate: Surrogate, found: Candidates
    ) -> np.ndarray:
        return log_moments(surrogate, found.u)[1]


@dataclass(frozen=True)
class PosteriorDraws(BestCandidates):
    """Draws from the posterior, mixed with maximisers of Var[L(u)].

    Attributes:
        share: Of draws among the points.
    """

    share: float = 0.5

    def __post_init__(self) -> None:
        checked_number("share", self.share, lambda share: 0.0 <= share <= 1.0, "from 0 to 1")

    def _score(
        self, rng: np.random.Generator, surrogate: Surrogate, found: Candidates
    ) -> np.ndarray:
        log_likelihood, log_variance = log_moments(surrogate, found.u)
        if rng.uniform() >= self.share:
            return log_variance
        # the largest of these is a draw in proportion to exp(log_likelihood - log_density)
        return log_likelihood - found.log_density + rng.gumbel(size=len(found.u))


@dataclass(frozen=True)
class ExpectedIntegratedVariance(BestCandidates):
    """Minimise Var[L] as it is expected after the run, integrated over the box.

    EIV of Jarvenpaa et al. (2019), EIVAR of Surer et al. (2024). Since E[L^2] does not change
    in expectation, that is to maximise the integral of E[E[L | run]^2].
    """

    def _score(
        self, rng: np.random.Generator, surrogate: Surrogate, found: Candidates
    ) -> np.ndarray:
        rows = rng.permutation(len(found.u))[:INTEGRATION_NODES]
        resolved = surrogate.log_second_moment(found.u[rows], found.u)
        return log_sum_exp((resolved - found.log_density[rows, None]).T)


@dataclass(frozen=True)
class CautiousDraws:
    """`PosteriorDraws` of the posterior that a fit would give, in which doubt counts against a
    place; and EIV of that in which it counts as agreement, so that no mode stays unseen.

    Attributes:
        share: Of EIV's points; their number is rounded at random.
    """

    share: float = 0.25

    def __post_init__(self) -> None:
        checked_number("share", self.share, lambda share: 0.0 <= share <= 1.0, "from 0 to 1")

    def __call__(self, key: jax.Array, surrogate: Surrogate, n: int) -> np.ndarray:
        """n different points u [n, d]."""
        first = n - int(n * self.share + generator(key).uniform())
        points = np.zeros((0, surrogate.u.shape[1]))
        if first:
            points = PosteriorDraws()(key, surrogate.cautious, first)
        if first == n:
            return points
        more = ExpectedIntegratedVariance()(key, surrogate.fantasize(points), n - first)
        return np.concatenate([points, more])


RULES = {
    "lcb": LowerConfidenceBound,
    "maxvar": MaxVariance,
    "eiv": ExpectedIntegratedVariance,
    "draws": PosteriorDraws,
    "cautious": CautiousDraws,
}
"""Acquisitions by the name users give."""


def resolve_acquisition(given: str | Acquisition | None, family: Family) -> Acquisition:
    """The acquisition that a user means.

    Args:
        given: As in `Bolfi`; None is the family's own.
        family: Of the surrogates by which it will choose.

    Raises:
        ValueError: an unknown name, nothing that can be called as an acquisition is, or "lcb"
            for surrogates without a lower bound.
    """
    named: Any = family.acquisition if given is None else given
    acquisition = RULES[named]() if isinstance(named, str) and named in RULES else named
    if not callable(acquisition) or isinstance(acquisition, type):
        raise ValueError(
            f"acquisition must be one of {tuple(RULES)}, an object to be called or None, "
            f"got {named!r:.100}"
        )
    check_called("acquisition", acquisition, "key", "surrogate", "n")
    if isinstance(acquisition, LowerConfidenceBound) and not family.has_lower_bound:
        others = tuple(name for name in RULES if name != "lcb")
        raise ValueError(
            "the acquisition 'lcb' needs surrogate='discrepancy', or another that has a lower "
            f"bound, got {family!r:.100}; use one of {others}"
        )
    return cast(Acquisition, acquisition)


def chosen(u: object, shape: tuple[int, int]) -> np.ndarray:
    """The points to ask for, prior quantiles float64 [n, d], from what an acquisition returned.

    They are coarser than rounding errors, so that another processor asks for the same.

    Raises:
        ValueError: of another shape, or not prior quantiles.
    """
    points = checked_array("what acquisition returns", u)
    inside = (points >= -EDGE) & (points <= 1.0 + EDGE)  # NaN is neither
    if points.shape != shape or not inside.all():
        raise ValueError(
            f"acquisition must return u of shape {shape}, prior quantiles from 0 to 1 of "
            f"{shape[0]} points, got shape {points.shape}: {points}"
        )
    return np.clip(np.round(points, DIGITS), EDGE, 1.0 - EDGE)
