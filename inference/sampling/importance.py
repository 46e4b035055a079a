"""A weighted population of points that stands for the posterior, modes and their weights included.

Adaptive importance sampling: a quasi-random screen of the prior, then rounds of proposals from
a mixture fitted to what was found so far, tempered while the posterior is too narrow for it.
All points of all rounds count, weighted by the mixture of everything that proposed (Cornuet et
al. 2012, adaptive multiple importance sampling; Veach and Guibas 1995, balance heuristic).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from ..sobol import sobol
from .mixture import UNIFORMS, Mixture, fit_mixture, log_density, log_prior, propose
from .target import NOWHERE_FINITE, Target, log_likelihood

ROUND_POINTS = 256  # points of each round
SCREEN_POINTS = 1024  # points that fill the prior evenly
MAX_ROUNDS = 40  # at most; an easy posterior stops after two or three
MIN_EFFECTIVE = 400.0  # effective points at which one more round ends it
BOX_EDGE = 1e-12  # quantile at which the box is cut, so that x = Phi^-1(u) stays finite
MIN_LOG_POWER = -60.0  # log of the smallest inverse temperature
HALVINGS = 30  # of the interval of log powers
LEAST = 1e-12  # sd, and weight of a draw, where a posterior is one point
SHARPENED_WIDTH = 0.5  # width of half the proposals, while the temperature still has to fall


class Population(NamedTuple):
    """Weighted points, and the mixture that proposes more of their kind.

    Coordinates x = Phi^-1(u), in which the prior is standard normal. sum_i w_i f(x_i) / sum_i w_i
    estimates the posterior mean of f.
    """

    x: np.ndarray  # [n, d]
    log_weights: np.ndarray  # [n]; their logsumexp estimates the log evidence; -inf: not used
    mixture: Mixture
    log_proposal: np.ndarray  # [n], log density of the mixture
    effective: float  # number of points, (sum w)^2 / sum w^2

    @property
    def weights(self) -> np.ndarray:
        """Of the points, whose sum is 1 [n]."""
        weights = np.exp(self.log_weights - self.log_weights.max())
        return weights / weights.sum()

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


def resampled(rng: np.random.Generator, found: Population, n: int) -> np.ndarray:
    """n different points x [n, d], drawn by weight (Gumbel top-n): every mode of some weight
    attracts some of them, wherever in the prior it lies."""
    noisy = found.log_weights + rng.gumbel(size=len(found.x))
    return found.x[np.argsort(-noisy)[:n]]


def weighted_quantiles(
    values: np.ndarray, weights: np.ndarray, shares: Sequence[float]
) -> np.ndarray:
    """Quantiles [len(shares)] of weighted values [n]."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return np.interp(shares, reached / reached[-1], values[order])


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
    now = _Points(x, _log_likelihoods(target, x), math.log(SCREEN_POINTS) + log_prior(x))
    if not np.isfinite(now.log_likelihood).any():
        raise ValueError(NOWHERE_FINITE)
    mixtures: list[Mixture] = []
    before = 0.0
    while len(mixtures) < 1 or (len(mixtures) < MAX_ROUNDS and before < MIN_EFFECTIVE):
        before = _effective(now.log_weights())
        mixtures.append(fit_mixture(now.x, *_tempered_weights(now)))
        uniforms = _inside(cloud + rng.random(d + UNIFORMS))
        new = propose(mixtures[-1], ndtri(uniforms[:, :d]), uniforms[:, d:])
        mass = math.log(SCREEN_POINTS) + log_prior(new)
        for mixture in mixtures[:-1]:
            mass = np.logaddexp(mass, math.log(ROUND_POINTS) + log_density(mixture, new))
        joined = _Points(new, _log_likelihoods(target, new), mass)
        now = _Points(*(np.concatenate(parts) for parts in zip(now, joined, strict=True)))
        log_share = math.log(ROUND_POINTS) + log_density(mixtures[-1], now.x)
        now = now._replace(log_mass=np.logaddexp(now.log_mass, log_share))
    weights = now.log_weights()
    proposed = log_density(mixtures[-1], now.x)
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
