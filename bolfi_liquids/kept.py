"""Simulations outside the engine's loop, kept in the same bank."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .inference import SimulationBank
from .inference.simulate import jobs, run_missing
from .progress import Simulate


class Keep(NamedTuple):
    """Where simulations are kept, and how many run at the same time."""

    bank: SimulationBank
    identity: str  # the simulator's name in the bank
    batch: int


class Kept(NamedTuple):
    """Finished simulations."""

    signals: NDArray[np.float64]  # (successful simulations, *signal_shape)
    seconds: float  # spent in the simulator, also in an earlier call [s]


def simulate_kept(
    simulate: Simulate, theta: Mapping[str, NDArray], seeds: Sequence[int], keep: Keep
) -> Kept:
    """Signals for each theta and seed; those found in the bank are not simulated again.

    Args:
        simulate: As given to `inference.fit`.
        theta: Name -> values, shape (n,).
        seeds: n seeds.
        keep: Finished simulations are taken from there and put there.

    Returns:
        The simulations in order; failed ones are left out of the signals.

    Raises:
        RuntimeError: Every simulation failed.
    """
    todo = jobs(theta, seeds)
    results = []
    for start in range(0, len(todo), keep.batch):
        some = todo[start : start + keep.batch]
        results += run_missing(simulate, some, keep.bank, keep.identity, None)
    signals = [result.signal for result in results if result.signal is not None]
    if not signals:
        raise RuntimeError(f"all {len(todo)} simulations failed; the first: {results[0].error}")
    return Kept(np.stack(signals), sum(result.seconds for result in results))


def fresh_seeds(seed: int, purpose: int, count: int) -> list[int]:
    """Seeds in [0, 2^31) that neither the engine nor another purpose uses.

    Args:
        seed: Of the run.
        purpose: Tells the uses of one run apart.
        count: How many.
    """
    words = np.random.SeedSequence(seed, spawn_key=(purpose,)).generate_state(count)
    return [int(word >> 1) for word in words]
