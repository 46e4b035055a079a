"""Simulations outside the engine's loop, kept in the same bank."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inference.simulations import Keep, jobs, run_missing, stacked, succeeded
from ..progress import Advance, Simulate, silent


class Kept(NamedTuple):
    """Finished simulations."""

    signals: NDArray[np.float64]  # (successful simulations, *signal_shape)
    places: NDArray[np.int64]  # of these among those asked for
    seconds: float  # spent in the simulator, also in an earlier call [s]


def simulate_kept(
    simulate: Simulate,
    theta: Mapping[str, NDArray],
    seeds: Sequence[int],
    keep: Keep,
    *,
    advance: Advance = silent,
) -> Kept:
    """Signals for each theta and seed; those found in the bank are not simulated again.

    Args:
        simulate: As given to `inference.fit`.
        theta: Name -> values, shape (n,).
        seeds: n seeds.
        keep: Where simulations are made and kept.
        advance: Called with 1 for each simulation, also for those found in the bank.

    Returns:
        The simulations in order; failed ones are left out of the signals.

    Raises:
        RuntimeError: Every simulation failed.
    """
    asked = jobs(theta, seeds)
    results = run_missing(simulate, asked, keep, advance=advance)
    good = succeeded(results)
    if not good:
        raise RuntimeError(
            f"all {len(seeds)} simulations failed, the first at {asked[0].theta}"
            f" ({results[0].error or 'it diverged'}); use more particles"
        )
    seconds = sum(result.seconds for result in results)
    return Kept(np.stack(list(good.values())), np.array(list(good)), seconds)


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
