"""Simulations outside the engine's loop, kept in the same bank."""

import logging
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inference.simulations import Compute, jobs, run_missing, succeeded
from ..inference.simulations.failures import Failure, kind, not_finite
from ..progress import Advance, silent
from ..simulators import FluidSimulator

logger = logging.getLogger(__name__)

CURES = {
    Failure.RAISED: "remove the cause and repeat the call: nothing that has finished is lost",
    Failure.NOT_FINITE: "simulate with more particles, or leave such liquids out of the prior",
    Failure.TIMEOUT: "allow more time, and repeat the call",
    Failure.UNUSABLE: "mend the simulator and repeat the call",
}
"""What to do where every simulation failed, by the kind of the first one's failure."""


class Kept(NamedTuple):
    """Finished simulations."""

    signals: NDArray[np.float64]  # (successful simulations, *signal_shape)
    places: NDArray[np.int64]  # of these among those asked for
    seconds: float  # spent in the simulator, also in an earlier call [s]


def simulate_kept(
    simulator: FluidSimulator,
    theta: Mapping[str, NDArray],
    seeds: Sequence[int],
    compute: Compute,
    *,
    advance: Advance = silent,
) -> Kept:
    """Signals for each theta and seed; those found in the bank are not simulated again.

    Args:
        simulator: Of stirs or pours; the bank knows its simulations by its identity.
        theta: Name -> values, shape (n,).
        seeds: n seeds.
        compute: Where simulations are made and kept.
        advance: Called with 1 for each simulation, also for those found in the bank.

    Returns:
        The simulations in order; failed ones are left out of the signals.

    Raises:
        RuntimeError: Every simulation failed.
    """
    asked = jobs(theta, seeds)
    results = run_missing(
        simulator.simulate, asked, compute, identity=simulator.identity, advance=advance
    )
    good = succeeded(results)
    errors = [
        "" if place in good else result.error or not_finite("it diverged")
        for place, result in enumerate(results)
    ]
    if not good:
        failure = kind(errors[0])
        raise RuntimeError(
            f"all {len(seeds)} simulations failed, the first at {asked[0].theta}"
            f" ({errors[0]}); {CURES[failure]}"
        )
    warn_of_failures(errors, compute.timeout)
    seconds = sum(result.seconds for result in results)
    return Kept(np.stack(list(good.values())), np.array(list(good)), seconds)


def warn_of_failures(errors: Sequence[str], timeout: float | None) -> None:
    """Log how many simulations were given up or failed otherwise, which bars count as done.

    Args:
        errors: Why each failed; "" where it did not.
        timeout: The limit [s] that some exceeded.
    """
    failed = [error for error in errors if error]
    others = [error for error in failed if kind(error) is not Failure.TIMEOUT]
    if overdue := len(failed) - len(others):
        what = "%d of %d simulations took longer than %s s and count as failed"
        logger.warning(what, overdue, len(errors), timeout)
    if others:
        what = "%d of %d simulations failed and are left out; the first: %s"
        logger.warning(what, len(others), len(errors), " ".join(others[0].split()))
