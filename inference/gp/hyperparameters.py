"""Maximum a posteriori hyperparameters of Gaussian processes."""

import numpy as np

from .._lazy import stats
from .optimise import minimise_many
from .process import JITTER, TREND_SD, Data, Hyper, coordinates, inverse_cholesky, relevance, trend

GROWTH = 1.3  # hyperparameters are found anew when data have grown by this factor

# Normal priors of the logs: inputs are coordinates of the prior's sd (see
# `gp.process.coordinates`) and targets of about unit variance, so one choice fits every parameter,
# unit and simulator.
LENGTH = (np.log(1.0), 1.5)  # 95 %: a twentieth of the box to 20 times the box: no effect at all
AMPLITUDE = (np.log(1.0), 0.7)
NOISE = (np.log(0.2), 1.0)  # 95 %: 3 % of the targets' sd to more than all of it
SCORED_STARTS = 8  # starts that are evaluated
REFINED_STARTS = 2  # best of these, which are optimised
CACHED_NUMBERS = 8192  # of a matrix of each process, so that these stay near


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
    definite. What is found of a process depends on no other, to the last bit.
    """
    at = coordinates(data.u, data.tails)
    squared = ((at[:, None, :] - at) ** 2).reshape(-1, at.shape[1])
    together = max(1, CACHED_NUMBERS // len(squared))
    parts = [
        _together(
            Hyper(*(part[some] for part in hyper)), data._replace(y=data.y[some]), at, squared
        )
        for some in (slice(i, i + together) for i in range(0, len(data.y), together))
    ]
    values, gradients = (np.concatenate(part) for part in zip(*parts, strict=True))
    return values, gradients


def _together(
    hyper: Hyper, data: Data, at: np.ndarray, squared: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Log marginal likelihoods and gradients of a few processes at coordinates [n, d], whose
    squared differences are [n n, d]."""
    (n, d), k, diagonal = at.shape, len(data.y), np.arange(len(at))
    basis = trend(hyper, at)
    noise, rate = data.noise(hyper.log_noise), np.exp(-2.0 * hyper.log_length)
    # in place, as what is allocated takes as long as what is computed
    smooth = (squared @ (-0.5 * rate[:, :, None])).reshape(k, n, n)
    smooth += 2.0 * hyper.log_amplitude[:, None, None]
    np.exp(smooth, out=smooth)
    gram = (TREND_SD**2 * basis) @ basis.mT
    gram += smooth
    gram[:, diagonal, diagonal] += noise + JITTER
    for one in gram:
        one[:] = inverse_cholesky(one)
    whitener = gram
    white = whitener @ data.y[..., None]
    weights = whitener.mT @ white
    # `np.diagonal` has one memory layout for one process and for several, so sums have one order
    roots = np.diagonal(whitener, axis1=1, axis2=2)
    values = np.log(roots).sum(1) - 0.5 * np.sum(white**2, axis=(1, 2))
    # dL = trace(excess dK) / 2
    excess = whitener.mT @ whitener
    np.subtract(weights * weights.mT, excess, out=excess)
    pulled = np.multiply(smooth, excess, out=smooth)
    by_length = 0.5 * rate * (pulled.reshape(k, 1, -1) @ squared)[:, 0]
    along = np.sum(basis * (excess @ basis), axis=1)
    fading = 1.0 - relevance(hyper) ** 2  # -d log r / d log length
    of_trend = fading * (along[:, 1 : d + 1] + 2.0 * along[:, d + 1 :])
    by_noise = np.sum(noise * np.diagonal(excess, axis1=1, axis2=2), axis=1)
    others = pulled.sum(axis=(1, 2)), by_noise
    gradients = np.column_stack([by_length - TREND_SD**2 * of_trend, *others])
    return values - 0.5 * n * np.log(2.0 * np.pi), gradients


def negative_log_posterior(vectors: np.ndarray, data: Data) -> tuple[np.ndarray, np.ndarray]:
    """Minus the log posterior densities [k] of vectors [k, d + 2], up to a constant, and the
    gradients [k, d + 2]."""
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

    y = data.y[taught]

    def evaluate(vectors: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return negative_log_posterior(vectors, data._replace(y=y[rows % len(y)]))

    if previous is not None:
        found[taught] = minimise_many(evaluate, pack(previous)[taught])[0]
        return unpack(found)
    candidates = starts(data.u.shape[1])
    every = np.arange(SCORED_STARTS * len(y))
    scores = evaluate(np.repeat(candidates, len(y), axis=0), every)[0].reshape(SCORED_STARTS, -1)
    order = np.argsort(np.where(np.isfinite(scores), scores, np.inf), axis=0)[:REFINED_STARTS]
    x, values = minimise_many(evaluate, candidates[order].reshape(-1, candidates.shape[1]))
    best = np.argmin(values.reshape(REFINED_STARTS, -1), axis=0)
    found[taught] = x[best * len(y) + np.arange(len(y))]
    return unpack(found)
