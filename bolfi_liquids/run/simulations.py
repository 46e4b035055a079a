"""Simulations outside the engine's loop, kept in the same bank."""

import logging
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inference.simulations import Compute, jobs, run_missing, succeeded
from ..inference.simulations.failures import Failure, FailureKind, not_finite
from ..progress import Advance, silent
from ..simulators import FluidSimulator

logger = logging.getLogger(__name__)

CURES = {
    FailureKind.RAISED: "remove the cause and repeat the call: nothing that has finished is lost",
    FailureKind.NOT_FINITE: "simulate with more particles, or leave such liquids out of the prior",
    FailureKind.TIMEOUT: "allow more time, and repeat the call",
    FailureKind.UNUSABLE: "mend the simulator and repeat the call",
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
    before: Sequence[Failure | None] = (),
) -> Kept:
    """Signals for each theta and seed; those found in the bank are not simulated again.

    Args:
        simulator: Of stirs or pours; its identity names its simulations in the bank.
        theta: Name -> values, shape (n,).
        seeds: n seeds.
        compute: Where simulations are made and kept.
        advance: Called with 1 for each simulation, also for those found in the bank.
        before: Failures of simulations made before; the log counts them with these.

    Returns:
        The simulations in order; failed ones are left out of the signals.

    Raises:
        RuntimeError: Every simulation failed.
    """
    asked = jobs(theta, seeds)
    results = run_missing(
        simulator.batched, asked, compute, identity=simulator.identity, advance=advance
    )
    good = succeeded(results)
    failed = {
        place: result.error or not_finite("it diverged")
        for place, result in enumerate(results)
        if place not in good
    }
    if not good:
        raise RuntimeError(
            f"all {len(seeds)} simulations failed, the first at {asked[0].theta}"
            f" ({failed[0]}); {CURES[failed[0].kind]}"
        )
    _warn_of_failures([*before, *map(failed.get, range(len(results)))], compute.timeout)
    seconds = sum(result.seconds for result in results)
    return Kept(np.stack(list(good.values())), np.array(list(good)), seconds)


def _warn_of_failures(failures: Sequence[Failure | None], timeout: float | None) -> None:
    """Log how many simulations were given up or failed otherwise, which bars count as done.

    Args:
        failures: Of each simulation; None where it succeeded.
        timeout: The limit [s] that some exceeded.
    """
    failed = [one for one in failures if one is not None]
    others = [one for one in failed if one.kind is not FailureKind.TIMEOUT]
    if overdue := len(failed) - len(others):
        what = "%d of %d simulations took longer than %s s and count as failed"
        logger.warning(what, overdue, len(failures), timeout)
    if others:
        what = "%d of %d simulations failed and are left out; the first: %s"
        logger.warning(what, len(others), len(failures), " ".join(str(others[0]).split()))
