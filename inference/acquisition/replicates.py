"""Replicates measure run-to-run noise directly."""

import numpy as np

from ..history import History
from ..surrogates.emulator import EQUAL_RUNS_TOLERANCE

FIRST_REPLICATES = 2  # replicates to begin with, which tell a deterministic simulator
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
    if len(known) - len(points) >= wanted or _deterministic(theta, features, repeated):
        return None
    for i in np.argsort(history.discrepancy[good], kind="stable"):
        if not (repeated == theta[i]).all(1).any():
            return theta[i]
    return None


def _deterministic(theta: np.ndarray, features: np.ndarray, repeated: np.ndarray) -> bool:
    """Whether the runs at FIRST_REPLICATES or more repeated points are equal."""
    groups = [features[(theta == point).all(1)] for point in repeated]
    told = [group for group in groups if len(group) > 1]
    tolerance = EQUAL_RUNS_TOLERANCE * features.std(0)
    equal = [(np.abs(group - group[0]).max(0) <= tolerance).all() for group in told]
    return len(told) >= FIRST_REPLICATES and all(equal)
