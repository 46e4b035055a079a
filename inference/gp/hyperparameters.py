"""Maximum a posteriori hyperparameters of Gaussian processes."""

import numpy as np

from .._lazy import stats
from .optimise import minimise_many
from .process import (
    JITTER,
    TREND_SD,
    Data,
    Hyper,
    coordinates,
    inverse_cholesky,
    relevance,
    smooth_covariance,
    trend,
)

GROWTH = 1.3  # hyperparameters are found anew when data have grown by this factor

# Normal priors of the logs: inputs are coordinates of the prior's sd (see
# `gp.process.coordinates`) and targets of about unit variance, so one choice fits every parameter,
# unit and simulator.
LENGTH = (np.log(1.0), 1.5)  # 95 %: a twentieth of the box to 20 times the box: no effect at all
AMPLITUDE = (np.log(1.0), 0.7)
NOISE = (np.log(0.2), 1.0)  # 95 %: 3 % of the targets' sd to more than all of it
SCORED_STARTS = 8  # starts that are evaluated
REFINED_STARTS = 2  # best of these, which are optimised


def unpack(vectors: np.ndarray) -> Hyper:
    """[k, d + 2] -> Hyper."""
    return Hyper(vectors[:, :-2], vectors[:, -2], vectors[:, -1])


def pack(hyper: Hyper) -> np.ndarray:
    """Hyper -> [k, d + 2]."""
    return np.column_stack(hyper)


def prior_moments(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sd [dimension + 2] of the hyperparameters' logs."""
    mean, sd = np.array([LENGTH] * dimension + [AMPLITUDE, NOISE]).T
    return mean, sd


def log_marginal_likelihood(hyper: Hyper, data: Data) -> tuple[np.ndarray, np.ndarray]:
    """log p(y | hyper) [k], trend integrated out, and its gradient [k, d + 2].

    Rasmussen and Williams (2006), eqs. 2.30 and 5.9; NaN where a Gram matrix is not positive
    definite.
    """
    at = coordinates(data.u, data.normal)
    squared = (at[:, None, :] - at) ** 2  # [n, n, d]
    (n, d), k = at.shape, len(data.y)
    basis = trend(hyper, at)
    noise, rate = data.noise(hyper.log_noise), np.exp(-2.0 * hyper.log_length)
    fading = 1.0 - relevance(hyper) ** 2  # -d log r / d log length
    values, gradients = np.empty(k), np.empty((k, d + 2))
    for i, y in enumerate(data.y):
        # one by one: what is found of a process depends on no other, to the last bit
        smooth = smooth_covariance(Hyper(*(part[i : i + 1] for part in hyper)), squared)[0]
        gram = smooth + TREND_SD**2 * basis[i] @ basis[i].T
        gram[np.diag_indices(n)] += noise[i] + JITTER
        whitener = inverse_cholesky(gram)
        white = whitener @ y
        weights = white @ whitener
        values[i] = np.sum(np.log(np.diag(whitener))) - 0.5 * white @ white
        # dL = trace(excess dK) / 2
        excess = np.outer(weights, weights) - whitener.T @ whitener
        pulled = excess * smooth
        by_length = 0.5 * rate[i] * (pulled.ravel() @ squared.reshape(-1, d))
        along = np.sum(basis[i] * (excess @ basis[i]), axis=0)
        of_trend = fading[i] * (along[1 : d + 1] + 2.0 * along[d + 1 :])
        gradients[i, :d] = by_length - TREND_SD**2 * of_trend
        gradients[i, d] = pulled.sum()
        gradients[i, d + 1] = noise[i] @ np.diag(excess)
    return values - 0.5 * n * np.log(2.0 * np.pi), gradients


def negative_log_posterior(vectors: np.ndarray, data: Data) -> tuple[np.ndarray, np.ndarray]:
    """Of vectors [k, d + 2], up to a constant [k], and the gradients [k, d + 2]."""
    mean, sd = prior_moments(data.u.shape[1])
    z = (vectors - mean) / sd
    values, gradients = log_marginal_likelihood(unpack(vectors), data)
    return 0.5 * np.sum(z**2, axis=1) - values, z / sd - gradients


def starts(dimension: int) -> np.ndarray:
    """Fixed quasi-random draws from the priors, [SCORED_STARTS, dimension + 2]."""
    mean, sd = prior_moments(dimension)
    uniform = stats.qmc.Halton(dimension + 2, scramble=False).random(SCORED_STARTS + 1)[1:]
    return mean + sd * stats.norm.ppf(uniform)


def maximum_a_posteriori(data: Data, previous: Hyper | None = None) -> Hyper:
    """The best of several quasi-Newton runs for each of the k processes.

    Targets that are all zero teach nothing: there the prior's mode. A pure function of its
    arguments, so resuming agrees.

    Args:
        previous: The optimum for less data; optimisation then starts from there alone.
    """
    taught = np.any(data.y, axis=1)
    found = np.tile(prior_moments(data.u.shape[1])[0], (len(taught), 1))
    if not taught.any():
        return unpack(found)

    def evaluate(vectors: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return negative_log_posterior(vectors, data._replace(y=data.y[taught][rows]))

    every = np.arange(taught.sum())
    if previous is not None:
        found[taught] = minimise_many(evaluate, pack(previous)[taught])[0]
        return unpack(found)
    candidates = starts(data.u.shape[1])
    scores = np.array([evaluate(np.tile(c, (len(every), 1)), every)[0] for c in candidates])
    order = np.argsort(np.where(np.isfinite(scores), scores, np.inf), axis=0)
    runs = [minimise_many(evaluate, candidates[order[i]]) for i in range(REFINED_STARTS)]
    best = np.argmin([values for _, values in runs], axis=0)
    found[taught] = np.array([x for x, _ in runs])[best, every]
    return unpack(found)
