"""The space-filling start design."""

import numpy as np
from scipy.stats import qmc


def start_size(dimension: int) -> int:
    """Default number of start points: two per coefficient of a separable quadratic, plus one.

    5, 7, 9 for one, two, three parameters.
    """
    return 2 * dimension + 3


def sobol(seed: int, start: int, stop: int, dimension: int) -> np.ndarray:
    """Points start..stop-1 of a scrambled Sobol sequence.

    Args:
        seed: Fixes the scrambling; equal seeds continue one sequence.
        start, stop: Half-open range of indices.
        dimension: Number of parameters.

    Returns:
        u [stop - start, dimension] in (0, 1).
    """
    engine = qmc.Sobol(dimension, scramble=True, rng=seed)
    # a full power of two: scipy warns of anything less, and prefixes agree between sizes
    points = engine.random_base2(max(stop - 1, 1).bit_length())
    return np.clip(points[start:stop], 1e-9, 1.0 - 1e-9)
