"""Runs that ended with an absurdly large discrepancy."""

import numpy as np

BEST_SHARE = 0.25  # of the runs, which tell how far discrepancies spread
MAX_DEVIATIONS = 1e9  # of that spread


def is_outlier(discrepancy: np.ndarray) -> np.ndarray:
    """Which of the discrepancies [n] are absurdly larger than the best quarter, bool [n]; NaN is
    not. Most runs may have blown up, or hold a number such as 1e16 in place of infinity."""
    deviation = discrepancy - np.nanmin(discrepancy, initial=np.inf)
    finite = deviation[np.isfinite(deviation)]
    spread = np.quantile(finite, BEST_SHARE) if finite.size else 0.0
    return (deviation / MAX_DEVIATIONS > spread) & (spread != 0.0)
