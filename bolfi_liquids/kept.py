"""Simulations outside the engine's loop, kept in the same bank."""

from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .inference import Simulation, SimulationBank
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
        The simulations in order; diverged ones are left out of the signals.

    Raises:
        RuntimeError: Every simulation diverged.
    """
    points = [
        {name: float(values[at]) for name, values in theta.items()} for at in range(len(seeds))
    ]
    wanted = list(zip(points, seeds, strict=True))
    missing = [job for job in wanted if keep.bank.get(keep.identity, *job) is None]
    for start in range(0, len(missing), keep.batch):
        _simulate_and_put(simulate, missing[start : start + keep.batch], keep)
    found = [keep.bank.get(keep.identity, *job) for job in wanted]
    results = [result for result in found if result is not None]
    good = [r.signal for r in results if r.signal is not None and np.isfinite(r.signal).all()]
    if not good:
        raise RuntimeError(
            f"all {len(seeds)} simulations diverged, the first at {points[0]}; use more particles"
        )
    return Kept(np.stack(good), sum(result.seconds for result in results))


def _simulate_and_put(
    simulate: Simulate, batch: Sequence[tuple[dict[str, float], int]], keep: Keep
) -> None:
    points, seeds = zip(*batch, strict=True)
    theta = {name: np.array([point[name] for point in points]) for name in points[0]}
    started = perf_counter()
    signals = simulate(theta, np.array(seeds, np.int64))
    seconds = (perf_counter() - started) / len(batch)
    for (point, seed), signal in zip(batch, signals, strict=True):
        keep.bank.put(keep.identity, point, seed, Simulation(signal, None, seconds))


def fresh_seeds(seed: int, purpose: int, count: int) -> list[int]:
    """Seeds in [0, 2^31) that neither the engine nor another purpose uses.

    Args:
        seed: Of the run.
        purpose: Tells the uses of one run apart.
        count: How many.
    """
    words = np.random.SeedSequence(seed, spawn_key=(purpose,)).generate_state(count)
    return [int(word >> 1) for word in words]
