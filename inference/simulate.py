"""Running a user's simulator: in batches or on an executor, and only where the bank is empty."""

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, as_completed
from typing import NamedTuple

import numpy as np

from .bank import Simulation, SimulationBank
from .base import Simulator


class Job(NamedTuple):
    """One run to be made."""

    theta: dict[str, float]
    seed: int


def simulation_seed(seed: int, index: int) -> int:
    """Seed of the index-th simulation of a run, in [0, 2^31)."""
    return int(np.random.SeedSequence([seed, index]).generate_state(1)[0] >> 1)


def jobs(theta: Mapping[str, np.ndarray], seeds: Sequence[int]) -> list[Job]:
    """One job per row of theta (name -> [n])."""
    return [
        Job({name: float(column[i]) for name, column in theta.items()}, int(seed))
        for i, seed in enumerate(seeds)
    ]


def run_batch(
    simulate: Simulator, batch: Sequence[Job], shape: tuple[int, ...] | None
) -> list[Simulation]:
    """Simulate all jobs in one call.

    An exception costs only the run that raised it: the batch is then repeated one by one.
    Seconds are shared out evenly.

    Args:
        shape: Of one signal; None accepts any.

    Raises:
        ValueError: the simulator returned other than one such row per job.
    """
    theta = {name: np.array([job.theta[name] for job in batch]) for name in batch[0].theta}
    seeds = np.array([job.seed for job in batch], np.int64)
    started = time.perf_counter()
    try:
        signals = np.asarray(simulate(theta, seeds), np.float64)
    except Exception as error:  # whatever the user's code raises is a failed run, and kept
        if len(batch) > 1:
            return [run_batch(simulate, [job], shape)[0] for job in batch]
        seconds = time.perf_counter() - started
        return [Simulation(None, f"{type(error).__name__}: {error}", seconds)]
    seconds = (time.perf_counter() - started) / len(batch)
    expected = (len(batch), *(signals.shape[1:] if shape is None else shape))
    if signals.shape != expected:
        raise ValueError(
            f"simulate must return signals of shape {expected}, one row per theta, "
            f"got {signals.shape}"
        )
    return [Simulation(signal, None, seconds) for signal in signals]


def run_missing(
    simulate: Simulator,
    batch: Sequence[Job],
    shape: tuple[int, ...] | None,
    bank: SimulationBank,
    identity: str,
    executor: Executor | None,
) -> list[Simulation]:
    """Results of all jobs, in order; those that the bank lacks are simulated and stored.

    Stored exceptions count as lacking: their cause, such as a full disk, may have gone. With an
    executor every missing job is a call of its own, stored as soon as it is finished.
    """
    results = [bank.get(identity, job.theta, job.seed) for job in batch]
    missing = [at for at, hit in enumerate(results) if hit is None or hit.error is not None]

    def store(at: int, made: Simulation) -> None:
        bank.put(identity, batch[at].theta, batch[at].seed, made)
        results[at] = made

    if executor is not None:
        futures = {executor.submit(run_batch, simulate, [batch[at]], shape): at for at in missing}
        for future in as_completed(futures):
            store(futures[future], future.result()[0])
    elif missing:
        made = run_batch(simulate, [batch[at] for at in missing], shape)
        for at, simulation in zip(missing, made, strict=True):
            store(at, simulation)
    return [result for result in results if result is not None]
