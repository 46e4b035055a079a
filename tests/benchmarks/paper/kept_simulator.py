"""A simulator that takes from a bank what it holds."""

from collections.abc import Mapping

import numpy as np
from bolfi_liquids.inference.simulations import Keep, jobs, run_missing, stacked
from numpy.typing import NDArray

from bolfi_liquids.progress import Simulate


def keeping(simulate: Simulate, shape: tuple[int, ...], keep: Keep) -> Simulate:
    """`simulate`, but for what the bank holds; what is simulated is put there.

    Args:
        simulate: As given to `inference.fit`.
        shape: Of a signal; a failed run's is NaN.
        keep: Where simulations are made and kept.
    """

    def kept(theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        results = run_missing(simulate, jobs(theta, seeds), keep, shape)
        return stacked(results, shape)

    return kept
