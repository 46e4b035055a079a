"""A mixture of Student t distributions, fitted to weighted points and proposing more.

Over x = Phi^-1(u), in which the prior is standard normal. One component is the prior itself,
so that no region of the prior is ever out of reach, and ratios to the posterior are bounded.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..gp.namespaces import log_sum_exp, namespace

COMPONENTS = 8
DEGREES_OF_FREEDOM = 6  # even: tails heavier than a posterior's, at little cost near it
PRIOR_SHARE = 0.05
EVEN_SHARE = 0.2  # share of the proposals spread evenly over the components, for small modes
RESAMPLED_POINTS = 512
EM_STEPS = 8  # of expectation maximisation
UNIFORMS = DEGREES_OF_FREEDOM // 2 + 2
"""Numbers, besides d normals, that make one draw."""


class Mixture(NamedTuple):
    """k components, each half at its own width and half at `sharpness` times that."""

    log_share: np.ndarray  # [k]
    mean: np.ndarray  # [k, d]
    factor: np.ndarray  # [k, d, d], lower triangular
    whitener: np.ndarray  # [k, d, d], inverse of factor
    sharpness: np.ndarray  # [], in (0, 1]


def log_density(mixture: Mixture, x: Any) -> Any:
    """Log density at x [n, d]: [n]."""
    xp = namespace(x)
    square, volume = _distances(mixture, x)
    wide = _log_student(square, x.shape[-1])
    sharp = _log_student(square / mixture.sharpness**2, x.shape[-1])
    sharp = sharp - x.shape[-1] * xp.log(mixture.sharpness)
    half = math.log(0.5 * (1.0 - PRIOR_SHARE)) + mixture.log_share + volume
    prior = math.log(PRIOR_SHARE) + log_prior(x)[:, None]
    return log_sum_exp(xp.concat([half + wide, half + sharp, prior], axis=-1))


def log_prior(x: Any) -> Any:
    """Standard normal log density at x [n, d]: [n]."""
    return -0.5 * namespace(x).sum(x**2, axis=-1) - 0.5 * x.shape[-1] * math.log(2.0 * math.pi)


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
