"""A weighted population of points that stands for the posterior, modes and their weights included.

Adaptive importance sampling: a quasi-random screen of the prior, then rounds of proposals from
a mixture fitted to what was found so far, tempered while the posterior is too narrow for it.
All points of all rounds count, weighted by the mixture of everything that proposed (Cornuet et
al. 2012, adaptive multiple importance sampling; Veach and Guibas 1995, balance heuristic).

Over x = Phi^-1(u), in which the prior is standard normal. One component of each mixture, of
Student t distributions, is the prior itself, so that no region of the prior is ever out of reach,
and ratios to the posterior are bounded.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri, softmax

from ..gp.namespaces import log_sum_exp, namespace
from ..sobol import sobol
from .target import Target, log_likelihood, log_prior, somewhere_finite

ROUND_POINTS = 256  # points of each round
SCREEN_POINTS = 1024  # points that fill the prior evenly
MAX_ROUNDS = 40  # at most; an easy posterior stops after two or three
MIN_EFFECTIVE = 400.0  # effective points at which one more round ends it
BOX_EDGE = 1e-12  # quantile at which the box is cut, so that x = Phi^-1(u) stays finite
MIN_LOG_POWER = -60.0  # log of the smallest inverse temperature
HALVINGS = 30  # of the interval of log powers
LEAST = 1e-12  # sd, and weight of a draw, where a posterior is one point
SHARPENED_WIDTH = 0.5  # width of half the proposals, while the temperature still has to fall
COMPONENTS = 8
DEGREES_OF_FREEDOM = 6  # even: tails heavier than a posterior's, at little cost near it
PRIOR_SHARE = 0.05
EVEN_SHARE = 0.2  # share of the proposals spread evenly over the components, for small modes
RESAMPLED_POINTS = 512
EM_STEPS = 8  # of expectation maximisation
EVIDENCE_POINTS = 4096
MAX_EXCESS = 50.0  # log of E[L^2] / E[L]^2, beyond which nothing is known
UNIFORMS = DEGREES_OF_FREEDOM // 2 + 2
"""Numbers, besides d normals, that make one draw."""


class Mixture(NamedTuple):
    """k components, each half at its own width and half at `sharpness` times that."""

    log_share: np.ndarray  # [k]
    mean: np.ndarray  # [k, d]
    factor: np.ndarray  # [k, d, d], lower triangular
    whitener: np.ndarray  # [k, d, d], inverse of factor
    sharpness: np.ndarray  # [], in (0, 1]


def log_mixture(mixture: Mixture, x: Any) -> Any:
    """Log density at x [n, d]: [n]."""
    xp = namespace(x)
    square, volume = _distances(mixture, x)
    wide = _log_student(square, x.shape[-1])
    sharp = _log_student(square / mixture.sharpness**2, x.shape[-1])
    sharp = sharp - x.shape[-1] * xp.log(mixture.sharpness)
    half = math.log(0.5 * (1.0 - PRIOR_SHARE)) + mixture.log_share + volume
    prior = math.log(PRIOR_SHARE) + log_prior(x)[:, None]
    return log_sum_exp(xp.concat([half + wide, half + sharp, prior], axis=-1))


def propose(mixture: Mixture, z: np.ndarray, uniforms: np.ndarray) -> np.ndarray:
    """Draws x [n, d] made from normals z [n, d] and `uniforms` [n, UNIFORMS] in (0, 1)."""
    choice, half = uniforms[:, 0], uniforms[:, 1]
    # chi^2 of an even number of degrees is twice a sum of exponentials
    chi_square = -2.0 * np.sum(np.log(uniforms[:, 2:]), axis=-1)
    scale = np.sqrt(DEGREES_OF_FREEDOM / chi_square) * np.where(half < 0.5, 1.0, mixture.sharpness)
    within = (choice - PRIOR_SHARE) / (1.0 - PRIOR_SHARE)
    edges = np.cumsum(np.exp(mixture.log_share))[:-1]
    component = np.sum(within[:, None] > edges, axis=-1)
    shift = (mixture.factor[component] @ z[:, :, None])[:, :, 0]
    fitted = mixture.mean[component] + scale[:, None] * shift
    return np.where(choice[:, None] < PRIOR_SHARE, z, fitted)


def fit_mixture(x: np.ndarray, log_weights: np.ndarray, sharpness: float) -> Mixture:
    """Expectation maximisation on points x [n, d] with log weights [n].

    Starts by k-means++ (Arthur and Vassilvitskii 2007), which gives a distant mode a
    component even where its weight is small. Covariances are shrunk towards their average,
    as if by d + 2 points, so that few points make no flat component.
    """
    weights = np.exp(log_weights - np.max(log_weights))
    effective = np.sum(weights) ** 2 / np.sum(weights**2)
    cumulated = np.cumsum(weights)
    positions = (np.arange(RESAMPLED_POINTS) + 0.5) / RESAMPLED_POINTS  # systematic resampling
    drawn = np.searchsorted(cumulated, positions * cumulated[-1])
    points = x[np.minimum(drawn, len(x) - 1)]
    shares = np.eye(COMPONENTS)[_nearest_seed(points / (np.std(points, axis=0) + 1e-12))]
    fitted = _maximised(points, shares, effective, sharpness)
    for _ in range(EM_STEPS - 1):
        square, volume = _distances(fitted, points)
        logs = fitted.log_share + volume - 0.5 * square
        shares = np.exp(logs - log_sum_exp(logs)[:, None])
        fitted = _maximised(points, shares, effective, sharpness)
    even = (1.0 - EVEN_SHARE) * np.exp(fitted.log_share) + EVEN_SHARE / COMPONENTS
    return fitted._replace(log_share=np.log(even))


def _maximised(
    points: np.ndarray, shares: np.ndarray, effective: float, sharpness: float
) -> Mixture:
    """Components from points [n, d] of which each belongs to them by shares [n, k]."""
    n, d = points.shape
    mass = shares.sum(0) + 1e-12
    mean = (shares.T @ points) / mass[:, None]
    centred = points - mean[:, None, :]  # [k, n, d]
    scatter = (centred * shares.T[:, :, None]).mT @ centred
    pooled = scatter.sum(0) / n
    # a floor far below any posterior's width, for points that all coincide
    pooled = pooled + np.diag(1e-6 * np.diag(pooled) + 1e-16)
    count = effective / n  # a resampled point counts for as much as it is independent
    strength = d + 2.0
    covariance = (count * scatter + strength * pooled) / (count * mass + strength)[:, None, None]
    factor = np.linalg.cholesky(covariance)
    whitener = np.linalg.inv(factor)
    return Mixture(np.log(mass / mass.sum()), mean, factor, whitener, np.asarray(sharpness))


def _distances(mixture: Mixture, x: Any) -> tuple[Any, Any]:
    """Squared Mahalanobis distances of x [n, d]: [n, k]; log determinants of the whiteners [k]."""
    xp = namespace(x)
    z = (x - mixture.mean[:, None, :]) @ mixture.whitener.mT  # [k, n, d]
    diagonals = xp.linalg.diagonal(mixture.whitener)
    return xp.sum(z**2, axis=-1).T, xp.sum(xp.log(diagonals), axis=-1)


def _log_student(square: Any, d: int) -> Any:
    """Log density of the standard multivariate t at squared distance `square`."""
    constant = math.lgamma(0.5 * (DEGREES_OF_FREEDOM + d)) - math.lgamma(0.5 * DEGREES_OF_FREEDOM)
    constant = constant - 0.5 * d * math.log(DEGREES_OF_FREEDOM * math.pi)
    log_ratio = namespace(square).log1p(square / DEGREES_OF_FREEDOM)
    return constant - 0.5 * (DEGREES_OF_FREEDOM + d) * log_ratio


def _nearest_seed(points: np.ndarray) -> np.ndarray:
    """Which of the k-means++ seeds is nearest to each of points [n, d]: [n]."""
    # always the same noise: a proposal need not be random
    gumbel = np.random.default_rng(0).gumbel(size=(COMPONENTS, len(points)))
    distance, nearest = np.sum((points - points[0]) ** 2, axis=-1), np.zeros(len(points), int)
    for j in range(1, COMPONENTS):
        with np.errstate(divide="ignore"):  # of seeds themselves, which are not drawn again
            chosen = np.argmax(np.log(distance) + gumbel[j])  # drawn in proportion to distance
        new = np.sum((points - points[chosen]) ** 2, axis=-1)
        nearest = np.where(new < distance, j, nearest)
        distance = np.minimum(distance, new)
    return nearest


class Population(NamedTuple):
    """Weighted points, and the mixture that proposes more of their kind.

    sum_i w_i f(x_i) / sum_i w_i estimates the posterior mean of f.
    """

    x: np.ndarray  # [n, d]
    log_weights: np.ndarray  # [n]; their logsumexp estimates the log evidence; -inf: not used
    mixture: Mixture
    log_proposal: np.ndarray  # [n], log density of the mixture
    effective: float  # number of points, (sum w)^2 / sum w^2

    @property
    def weights(self) -> np.ndarray:
        """Weights of the points [n], whose sum is 1."""
        return softmax(self.log_weights)

    @property
    def moments(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of each coordinate, [d] each."""
        weights = self.weights
        mean = weights @ self.x
        return mean, np.sqrt(weights @ (self.x - mean) ** 2)

    def resample(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """`count` different points [count, d], one half drawn as they are weighted, the other in
        proportion to what they add to the variance, too: there a posterior is known least."""
        (mean, sd), weights = self.moments, self.weights + LEAST  # of one point, too
        plain = max(1, count // 2)
        first = rng.choice(len(self.x), plain, replace=False, p=weights / weights.sum())
        distance = np.sum(((self.x - mean) / np.maximum(sd, LEAST)) ** 2, axis=1)
        outer = weights * distance + LEAST
        outer[first] = 0.0
        others = rng.choice(len(self.x), count - plain, replace=False, p=outer / outer.sum())
        return self.x[np.append(others, first)]


class Evidence(NamedTuple):
    """Log of the likelihood's prior mean.

    Attributes:
        log: Natural logarithm.
        error: Its standard error, of chance among the points and of the emulator.
    """

    log: float
    error: float

    def __repr__(self) -> str:
        known = np.isfinite(self.error) and self.error > 0.0
        places = max(0, 1 - int(np.floor(np.log10(self.error)))) if known else 2
        return f"Evidence(log={self.log:.{places}f}, error={self.error:.2g})"


def evidence_of(
    found: Population, target: Target, log_second_moment: Callable[[np.ndarray], np.ndarray]
) -> Evidence:
    """The evidence of a likelihood that is itself known only through a surrogate.

    By new draws of the population's mixture, for weights of points to which it was fitted would
    give too little: 7 % in five dimensions. The variance of their weights tells the chance error.
    What the emulator does not know of the likelihood counts as if it erred alike everywhere in the
    posterior: an upper limit, and near it where the posterior is narrow. A log-normal factor of
    relative variance r has the log variance log(1 + r).

    Args:
        found: Points of the posterior.
        target: The posterior.
        log_second_moment: log E[L^2] at prior quantiles, see `Surrogate.log_second_moment`.
    """
    d = target.dimension
    uniforms = _inside(sobol(0, 0, EVIDENCE_POINTS, d + UNIFORMS))
    x = propose(found.mixture, ndtri(uniforms[:, :d]), uniforms[:, d:])
    log_mean = _log_likelihoods(target, x)
    log_weights = log_mean + log_prior(x) - log_mixture(found.mixture, x)
    top = log_weights.max()
    weights = np.exp(log_weights - top)
    used = weights > LEAST * weights.max()
    weights = weights / weights.sum()
    excess = log_second_moment(ndtr(x[used])) - 2.0 * log_mean[used]
    doubts = np.sqrt(np.expm1(np.clip(excess, 0.0, MAX_EXCESS)))
    doubt = float(np.log1p((weights[used] @ doubts) ** 2))
    chance = float(np.sum(weights**2)) - 1.0 / EVIDENCE_POINTS
    log = float(top + np.log(np.mean(np.exp(log_weights - top))))
    return Evidence(log, math.sqrt(max(chance, 0.0) + doubt))


def resampled(rng: np.random.Generator, found: Population, n: int) -> np.ndarray:
    """n different points x [n, d], drawn by weight (Gumbel top-n): every mode of some weight
    attracts some of them, wherever in the prior it lies."""
    noisy = found.log_weights + rng.gumbel(size=len(found.x))
    return found.x[np.argsort(-noisy)[:n]]


def weighted_quantiles(
    values: np.ndarray, weights: np.ndarray, shares: Sequence[float] | np.ndarray
) -> np.ndarray:
    """Quantiles [len(shares)] of weighted values [n]."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return np.interp(np.asarray(shares), reached / reached[-1], values[order])


class _Points(NamedTuple):
    x: np.ndarray  # [n, d]
    log_likelihood: np.ndarray  # [n]
    log_mass: np.ndarray  # [n], log of sum_r n_r q_r(x) over the screen and the rounds so far

    def log_weights(self, power: float = 1.0) -> np.ndarray:
        """Log of likelihood^power times prior over proposals' mass [n]."""
        return power * self.log_likelihood + log_prior(self.x) - self.log_mass


def explore(rng: np.random.Generator, target: Target) -> Population:
    """Weighted points of the posterior, and what proposes more of them.

    About 1500 to 2500 evaluations, the first 1024 in one call, then 256 a round; up to 4096 for
    posteriors so narrow that they must be approached in steps. A log likelihood that is not finite
    counts as zero likelihood.

    Raises:
        ValueError: the log likelihood was finite nowhere.
    """
    d = target.dimension
    even = sobol(0, 0, SCREEN_POINTS, d) + rng.random(d)
    cloud = sobol(1, 0, ROUND_POINTS, d + UNIFORMS)
    x = ndtri(_inside(even))
    first = somewhere_finite(_log_likelihoods(target, x))
    now = _Points(x, first, math.log(SCREEN_POINTS) + log_prior(x))
    mixtures: list[Mixture] = []
    before = 0.0
    while len(mixtures) < 1 or (len(mixtures) < MAX_ROUNDS and before < MIN_EFFECTIVE):
        before = _effective(now.log_weights())
        mixtures.append(fit_mixture(now.x, *_tempered_weights(now)))
        uniforms = _inside(cloud + rng.random(d + UNIFORMS))
        new = propose(mixtures[-1], ndtri(uniforms[:, :d]), uniforms[:, d:])
        mass = math.log(SCREEN_POINTS) + log_prior(new)
        for mixture in mixtures[:-1]:
            mass = np.logaddexp(mass, math.log(ROUND_POINTS) + log_mixture(mixture, new))
        joined = _Points(new, _log_likelihoods(target, new), mass)
        now = _Points(*(np.concatenate(parts) for parts in zip(now, joined, strict=True)))
        log_share = math.log(ROUND_POINTS) + log_mixture(mixtures[-1], now.x)
        now = now._replace(log_mass=np.logaddexp(now.log_mass, log_share))
    weights = now.log_weights()
    proposed = log_mixture(mixtures[-1], now.x)
    return Population(now.x, weights, mixtures[-1], proposed, _effective(weights))


def _inside(u: np.ndarray) -> np.ndarray:
    return np.clip(u % 1.0, BOX_EDGE, 1.0 - BOX_EDGE)


def _log_likelihoods(target: Target, x: np.ndarray) -> np.ndarray:
    values = log_likelihood(target, ndtr(x))
    return np.where(np.isfinite(values), values, -np.inf)


def _tempered_weights(now: _Points) -> tuple[np.ndarray, float]:
    """Tempered log weights, and the width factor of the next proposals.

    The power of the likelihood is the largest that leaves enough effective points (bisection).
    """
    enough = 32.0 + 16.0 * now.x.shape[1]
    if _effective(now.log_weights()) >= enough:
        return now.log_weights(), 1.0
    low, high = MIN_LOG_POWER, 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _effective(now.log_weights(math.exp(middle))) >= enough:
            low = middle
        else:
            high = middle
    return now.log_weights(math.exp(low)), SHARPENED_WIDTH


def _effective(log_weights: np.ndarray) -> float:
    """Kish's effective number of points."""
    weights = np.exp(log_weights - np.max(log_weights))
    return float(np.sum(weights) ** 2 / np.sum(weights**2))
