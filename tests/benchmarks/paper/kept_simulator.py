"""A simulator that takes from a bank what it holds."""

from collections.abc import Mapping

import numpy as np
from bolfi_liquids.inference.simulations import Compute, jobs, run_missing, stacked
from bolfi_liquids.inference.types import Simulator
from numpy.typing import NDArray


def keeping(
    simulate: Simulator, shape: tuple[int, ...], compute: Compute, identity: str = ""
) -> Simulator:
    """`simulate`, but for what the bank holds; what is simulated is put there.

    Args:
        simulate: As given to `inference.fit`.
        shape: Of a signal; a failed run's is NaN.
        compute: Where simulations are made and kept.
        identity: The simulator's name in the bank.
    """

    def kept(theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        results = run_missing(simulate, jobs(theta, seeds), compute, shape, identity=identity)
        return stacked(results, shape)

    return kept
