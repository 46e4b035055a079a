"""Replicates measure run-to-run noise directly."""

import numpy as np

from ..history import History
from ..surrogates.emulator import FIRST_REPLICATES, deterministic

REPLICATE_SHARE = 0.1  # of the simulations, where runs differ


def next_replicate(history: History, pending: np.ndarray) -> np.ndarray | None:
    """The parameters theta [d] to be simulated again now, or None.

    They are the best so far that have no replicate: there the noise matters most.

    Args:
        history: What was told.
        pending: Asked and not yet told, theta [m, d].
    """
    good, failed = history.distinct, ~history.succeeded
    theta, features = history.theta[good], history.features[good]
    known = np.concatenate([history.theta[good | failed], pending])  # what failed was tried
    points, count = np.unique(known, axis=0, return_counts=True)
    repeated = points[count > 1]
    wanted = max(FIRST_REPLICATES, int(REPLICATE_SHARE * len(known)))
    if len(known) - len(points) >= wanted or deterministic(theta, features):
        return None
    for i in np.argsort(history.discrepancy[good], kind="stable"):
        if not (repeated == theta[i]).all(1).any():
            return theta[i]
    return None
