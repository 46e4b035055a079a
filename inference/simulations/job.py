"""Running a user's simulator, in this process or in a worker.

Workers import this module to run a simulation: it must load nothing but NumPy and the standard
library (tested), so that they start quickly and stay small.
"""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from ..types import Simulator, SingleSimulator
from .bank import Simulation
from .failures import raised, timed_out

R = TypeVar("R")
BATCH = 4  # runs in one call, or in flight, where nobody says how many

Limit = Callable[[float], AbstractContextManager[object]]
"""Inside `limit(seconds)` a simulator raises TimeoutError once it has taken so long."""


class Job(NamedTuple):
    """One run to be made."""

    theta: dict[str, float]
    seed: int


class Overdue(Exception):
    """A call that was given up; not a TimeoutError, for a simulator may raise one itself."""


def simulation_seed(seed: int, index: int) -> int:
    """Seed of the index-th simulation of a run, in [0, 2^31)."""
    return int(np.random.SeedSequence([seed, index]).generate_state(1)[0] >> 1)


def jobs(theta: Mapping[str, np.ndarray], seeds: Sequence[int] | np.ndarray) -> list[Job]:
    """One job per seed, with the rows of theta (name -> [n or more]) in order."""
    return [
        Job({name: float(column[i]) for name, column in theta.items()}, int(seed))
        for i, seed in enumerate(seeds)
    ]


def columns(batch: Sequence[Job]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """theta (name -> [n]) and seeds (int64 [n]) of n jobs."""
    theta = {name: np.array([job.theta[name] for job in batch]) for name in batch[0].theta}
    return theta, np.array([job.seed for job in batch], np.int64)


@dataclass(frozen=True)
class OneByOne:
    """A simulator of single runs as one of batches, which is what the engine calls.

    Attributes:
        simulate: Callable (theta: name -> float, seed) -> signal [*signal_shape].
    """

    simulate: SingleSimulator

    @property
    def time_limit(self) -> Limit | None:
        """How the simulator of single runs stops itself; see `limit_of`."""
        return limit_of(self.simulate)

    def __call__(self, theta: Mapping[str, np.ndarray], seeds: np.ndarray) -> np.ndarray:
        """theta: name -> [n]; seeds: int64 [n]  ->  signals [n, *signal_shape]."""
        runs = [np.asarray(self.simulate(*job), np.float64) for job in jobs(theta, seeds.tolist())]
        return np.stack(runs)


def stacked(results: Sequence[Simulation], shape: tuple[int, ...] | None = None) -> np.ndarray:
    """Signals [n, *signal_shape] of n runs, rows of NaN where one failed.

    Args:
        shape: Of one signal where every run failed; None raises then.

    Raises:
        ValueError: signals of several shapes, or none and no `shape`.
    """
    found = {result.signal.shape for result in results if result.signal is not None}
    if len(found) > 1:
        raise ValueError(f"simulate must return signals of one shape, got {sorted(found)}")
    known = next(iter(found), shape)
    if known is None:
        raise ValueError(f"all {len(results)} simulations failed, so their shape is not known")
    empty = np.full(known, np.nan)
    return np.stack([empty if result.signal is None else result.signal for result in results])


def succeeded(results: Sequence[Simulation]) -> dict[int, np.ndarray]:
    """Place in the list -> signal, of the runs whose signal is finite."""
    return {
        place: result.signal
        for place, result in enumerate(results)
        if result.signal is not None and np.isfinite(result.signal).all()
    }


def run_batch(
    simulate: Simulator,
    batch: Sequence[Job],
    shape: tuple[int, ...] | None,
    timeout: float | None = None,
) -> list[Simulation]:
    """Simulate all jobs in one call.

    An exception, or taking too long, costs only the run to blame: the batch is then repeated one
    by one. Seconds are shared out evenly.

    Args:
        shape: Of one signal; None accepts any.
        timeout: Seconds per job that the call may take, see `within`.

    Raises:
        ValueError: the simulator returned other than one such row per job.
    """
    theta, seeds = columns(batch)
    started = time.perf_counter()
    try:
        signals = within(
            None if timeout is None else timeout * len(batch),
            lambda: np.asarray(simulate(theta, seeds), np.float64),
            limit_of(simulate),
        )
    # whatever the user's code raises is a failed run, and kept; many programs end by SystemExit
    except (Exception, SystemExit) as error:
        if len(batch) > 1:
            return [run_batch(simulate, [job], shape, timeout)[0] for job in batch]
        if isinstance(error, Overdue) and timeout is not None:
            return [Simulation(None, timed_out(timeout), timeout)]
        return [Simulation(None, raised(error), time.perf_counter() - started)]
    seconds = (time.perf_counter() - started) / len(batch)
    expected = (len(batch), *(signals.shape[1:] if shape is None else shape))
    if signals.shape != expected:
        raise ValueError(_misshapen(simulate, expected, signals.shape))
    return [Simulation(signal, None, seconds) for signal in signals]


def _misshapen(simulate: Simulator, expected: tuple[int, ...], got: tuple[int, ...]) -> str:
    if isinstance(simulate, OneByOne):
        return (
            f"with vectorised=False simulate must return the signal of one run, of shape "
            f"{expected[1:]}, got {got[1:]}"
        )
    cure = "; if it makes one run at a time, pass vectorised=False" if got == expected[1:] else ""
    return f"simulate must return signals of shape {expected}, one row per theta, got {got}{cure}"


def limit_of(simulate: Simulator | SingleSimulator) -> Limit | None:
    """How a simulator stops itself: the method `time_limit` of it, or of the object whose method
    it is; None if there is no such method."""
    return getattr(getattr(simulate, "__self__", simulate), "time_limit", None)


def within(timeout: float | None, call: Callable[[], R], limit: Limit | None = None) -> R:
    """What `call` returns or raises, if it does so in `timeout` seconds.

    With a `limit` the call stops itself, in this thread. Else it runs in a thread of its own.
    Python cannot stop a thread: one that is overdue is abandoned, and goes on, unheard, until it
    returns or the process ends. Code that never releases the interpreter's lock cannot be timed
    out.

    Raises:
        Overdue: it did not.
    """
    if timeout is None:
        return call()
    if limit is not None:
        ends = time.monotonic() + timeout
        try:
            with limit(timeout):
                return call()
        except TimeoutError as error:
            if time.monotonic() < ends:
                raise
            raise Overdue from error
    returned: list[R] = []
    failed: list[BaseException] = []

    def run() -> None:
        try:
            returned.append(call())
        except BaseException as error:  # for the caller to judge
            failed.append(error)

    # a daemon does not keep the process from ending
    thread = threading.Thread(target=run, name="simulate", daemon=True)
    thread.start()
    thread.join(min(timeout, threading.TIMEOUT_MAX))
    if failed:
        raise failed[0]
    if returned:
        return returned[0]
    raise Overdue
