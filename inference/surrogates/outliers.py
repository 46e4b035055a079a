"""Runs that ended with an absurdly large discrepancy."""

import numpy as np

MAX_DEVIATIONS = 1e6  # median deviations


def sane(discrepancy: np.ndarray) -> np.ndarray:
    """Which of the discrepancies [n] are not absurdly larger than the others, bool [n]; NaN is."""
    centre = np.nanmedian(discrepancy)
    deviation = np.abs(discrepancy - centre)
    spread = np.nanmedian(deviation)
    return ~(discrepancy > centre + MAX_DEVIATIONS * spread) | (spread == 0.0)
