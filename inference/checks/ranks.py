"""Where the truth lies among draws, as a number that is uniform if the draws are right."""

import numpy as np


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
