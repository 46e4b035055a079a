"""Where truths lie among draws, as ranks that are uniform if the draws are right, and simultaneous
bands for the ECDF of such ranks, exact (Säilynoja, Bürkner and Vehtari 2022).

Under uniformity the number of ranks below z is binomial at each z. A band that every point
keeps with probability 1 - gamma is kept by all points together less often; gamma is adjusted
until that probability is the wanted one. It needs no simulation: going up in z the counts are
a Markov chain with binomial steps (the paper's section 2.2), which also gives exact p-values.
"""

import functools
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln, xlogy

from .._lazy import stats

BISECTIONS = 30
SMALLEST_LEVEL = 1e-9


def quantiles(truth: np.ndarray, draws: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Randomised quantile of each truth among its own draws.

    Of m independent draws from the right distribution r lie below the truth, and r is uniform
    on 0..m; (r + jitter) / (m + 1) is then uniform on [0, 1] for every m, so replicates with
    unlike numbers of draws can be pooled. Ties are broken at random.

    Args:
        truth: [R].
        draws: [R, L]; NaN fills up rows with fewer draws.
        jitter: Uniform on [0, 1), [R].

    Returns:
        In [0, 1), [R].
    """
    below = np.sum(draws < truth[:, None], axis=1)
    tied = np.sum(draws == truth[:, None], axis=1)
    total = np.sum(~np.isnan(draws), axis=1)
    return (below + jitter * (tied + 1)) / (total + 1)


def to_ranks(quantile: np.ndarray, draws: int) -> np.ndarray:
    """Ranks 0..draws on one common scale; exactly the plain rank where `draws` were kept."""
    return np.minimum((quantile * (draws + 1)).astype(np.int64), draws)


def bin_count(replicates: int, draws: int) -> int:
    """Bins for a chi-square test of ranks 0..draws.

    The most that divide draws + 1 evenly, leave ten expected per bin and do not exceed 20,
    beyond which smooth misfits drown; at least two.
    """
    limit = max(2, min(20, replicates // 10))
    divisors = [k for k in range(2, limit + 1) if (draws + 1) % k == 0]
    return max(divisors, default=min(2, draws + 1))


class Band(NamedTuple):
    """Least and greatest counts of ranks below z, each array [k]."""

    z: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def counts_below(ranks: np.ndarray, draws: int) -> np.ndarray:
    """Number of ranks (0..draws) below 1, 2, .., draws: [draws]."""
    return np.cumsum(np.bincount(ranks, minlength=draws + 1))[:-1]


@functools.lru_cache(maxsize=32)
def band(n: int, draws: int, level: float) -> Band:
    """The band that holds all counts of n uniform ranks with probability `level` or little more.

    Args:
        n: Replicates.
        draws: Ranks are 0..draws.
        level: In (0, 1).
    """
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if _inside(n, draws, middle) >= level else (low, middle)
    lower, upper = _limits(n, draws, low)
    return Band(_grid(draws), lower, upper)


def p_value(ranks: np.ndarray, draws: int) -> float:
    """Probability that uniform ranks stray at least as far as these do.

    Exact; below `SMALLEST_LEVEL` per point the bound of Bonferroni, which costs nothing.
    """
    n = len(ranks)
    tails = _tails(n, draws)
    gamma = 2.0 * tails[np.arange(draws), counts_below(ranks, draws)].min()
    if gamma < SMALLEST_LEVEL:
        return draws * gamma
    # the region where every tail exceeds the observed one; equal tails differ by rounding
    return float(np.clip(1.0 - _inside(n, draws, gamma * (1.0 + 1e-9)), 0.0, 1.0))


def _grid(draws: int) -> np.ndarray:
    return np.arange(1, draws + 1) / (draws + 1)


@functools.lru_cache(maxsize=8)
def _tails(n: int, draws: int) -> np.ndarray:
    """The smaller binomial tail, the count itself included, of count c at point i: [k, n + 1]."""
    count, z = np.arange(n + 1), _grid(draws)[:, None]
    return np.minimum(stats.binom.cdf(count, n, z), stats.binom.sf(count - 1, n, z))


def _limits(n: int, draws: int, gamma: float) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest count at each point whose tail is at least gamma / 2."""
    kept = _tails(n, draws) >= gamma / 2
    return kept.argmax(axis=1), n - kept[:, ::-1].argmax(axis=1)


def _inside(n: int, draws: int, gamma: float) -> float:
    """Probability that n uniform ranks stay within the pointwise bands of gamma everywhere."""
    if not (_tails(n, draws) >= gamma / 2).any(axis=1).all():
        return 0.0
    lower, upper = _limits(n, draws, gamma)
    log_factorial = gammaln(np.arange(n + 1) + 1.0)
    start, mass = np.zeros(1, np.int64), np.ones(1)
    for i in range(draws):
        stop = np.arange(lower[i], upper[i] + 1)
        left, step = n - start[:, None], stop[None, :] - start[:, None]
        stay = left - step
        possible = (step >= 0) & (stay >= 0)
        step, stay = np.where(possible, step, 0), np.where(possible, stay, 0)
        p = 1.0 / (draws + 1 - i)  # chance of the next interval among those still ahead
        log_pmf = log_factorial[left] - log_factorial[step] - log_factorial[stay]
        log_pmf = log_pmf + xlogy(step, p) + xlogy(stay, 1.0 - p)
        mass = mass @ np.exp(np.where(possible, log_pmf, -np.inf))
        start = stop
    return float(mass.sum())
