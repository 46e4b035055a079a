"""Running a user's simulator, in this process or in a worker.

Workers import this module to run a simulation: it must load nothing but NumPy and the standard
library (tested), so that they start quickly and stay small.
"""

import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, NamedTuple, cast

import numpy as np

from ..arguments import Unusable, check_callable, checked_integer, checked_mapping, float64, require
from ..types import Simulator, SingleSimulator
from .bank import Simulation
from .failures import Failure, is_unusable, raised, timed_out, unusable

BATCH = 4  # runs in one call, or in flight, where nobody says how many

Limit = Callable[[float], AbstractContextManager[object]]
"""Inside `limit(seconds)` a simulator raises TimeoutError once it has taken so long."""


class Job(NamedTuple):
    """One run to be made."""

    theta: dict[str, float]
    seed: int


class Overdue(Exception):
    """A call that was given up; not a TimeoutError, for a simulator may raise one itself.

    Args:
        seconds: Which it was allowed.
    """

    def __init__(self, seconds: float):
        super().__init__(seconds)
        self.seconds = seconds


def simulation_seed(seed: int, index: int) -> int:
    """Seed of the index-th simulation of a run, in [0, 2^31)."""
    return int(np.random.SeedSequence([seed, index]).generate_state(1)[0] >> 1)


def jobs(theta: Mapping[str, np.ndarray], seeds: Sequence[int] | np.ndarray) -> list[Job]:
    """One job per seed, with the rows of theta (name -> [n or more]) in order.

    Raises:
        ValueError: a seed is no integer, or not from 0 to 2^31 - 1.
    """
    return [
        Job(
            {name: float(column[i]) for name, column in theta.items()},
            checked_integer("seed", seed, 0),
        )
        for i, seed in enumerate(seeds)
    ]


def columns(
    batch: Sequence[Job], neutral: Mapping[str, float] = MappingProxyType({})
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """theta (name -> [n]) and seeds (int64 [n]) of n jobs; what one lacks is neutral in it."""
    names = dict.fromkeys(name for job in batch for name in job.theta)
    theta = {
        name: np.array([job.theta[name] if name in job.theta else neutral[name] for job in batch])
        for name in names
    }
    return theta, np.array([job.seed for job in batch], np.int64)


@dataclass(frozen=True)
class BatchSimulator:
    """A simulator of batches, and how it is best called.

    Attributes:
        simulate: Callable (theta: name -> [b], seeds: [b]) -> signals [b, *signal_shape].
        together: Simulations that one call on a pool may make. Of 1 each is stored when it is
            finished, and a worker that is done takes the next.
        time_limit: How it stops itself, so that it stays in its thread; None if it does not.
        neutral: Parameter -> the value at which it changes nothing: runs that name others of these
            share a call.

    Raises:
        ValueError: `together` is no number of simulations, `time_limit` no function, or `neutral`
            maps no names.
    """

    simulate: Simulator
    identity: ClassVar[str] = ""  # see `OneByOne`
    together: int = field(default=1, compare=False)
    time_limit: Limit | None = field(default=None, compare=False)
    neutral: Mapping[str, float] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        checked_integer("together", self.together)
        check_callable("time_limit", self.time_limit)
        checked_mapping("neutral", self.neutral, "numbers")

    def __call__(self, theta: dict[str, np.ndarray], seeds: np.ndarray) -> np.ndarray:
        """theta: name -> [n]; seeds: int64 [n]  ->  signals [n, *signal_shape]."""
        return self.simulate(theta, seeds)


@dataclass(frozen=True)
class OneByOne:
    """A simulator of single runs as one of batches, which is what the engine calls.

    Attributes:
        simulate: Callable (theta: name -> float, seed) -> signal [*signal_shape].
        time_limit: See `BatchSimulator`.
        identity: Its name in a bank where `fit` is given none.
    """

    simulate: SingleSimulator
    time_limit: Limit | None = field(default=None, compare=False)
    identity: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        check_callable("time_limit", self.time_limit)

    def __call__(self, theta: Mapping[str, np.ndarray], seeds: np.ndarray) -> np.ndarray:
        """theta: name -> [n]; seeds: int64 [n]  ->  signals [n, *signal_shape].

        The simulator gets Python's own numbers: `random.seed` takes no others.

        Raises:
            ValueError: it returned something else than numbers.
        """
        return np.stack([float64(self.simulate(*job)) for job in jobs(theta, seeds)])

    def _check_here(self) -> None:
        """Raise ValueError where this computer lacks what every run needs."""


def for_engine(
    simulate: Simulator | SingleSimulator,
    vectorised: bool = True,
    together: int = 1,
    time_limit: Limit | None = None,
) -> BatchSimulator | OneByOne:
    """Wrap a user's simulator for the engine; keep one that is wrapped.

    Raises:
        ValueError: bad argument, or one that contradicts the simulator.
    """
    if isinstance(simulate, BatchSimulator | OneByOne):
        silent = vectorised and together == 1 and time_limit is None
        due = "come without vectorised, together and time_limit, which it holds itself"
        require(silent, f"a {type(simulate).__name__}", due, (vectorised, together, time_limit))
        return simulate
    if vectorised:
        return BatchSimulator(cast(Simulator, simulate), together, time_limit)
    require(together == 1, "together", "be left out with vectorised=False", together)
    return OneByOne(cast(SingleSimulator, simulate), time_limit)


def of_one_shape(results: Sequence[Simulation], batch: Sequence[Job]) -> list[Simulation]:
    """The results of jobs; a signal of another shape than the commonest is a failed run."""
    due = commonest([result.signal.shape for result in results if result.signal is not None])

    def judged(result: Simulation, job: Job) -> Simulation:
        if result.signal is None or result.signal.shape == due:
            return result
        told = f"a signal of shape {due} is expected, got {result.signal.shape} of {job}"
        return result._replace(signal=None, error=unusable(told))

    return list(map(judged, results, batch))


def commonest(shapes: Sequence[tuple[int, ...]]) -> tuple[int, ...] | None:
    """The shape that occurs most often, the first of them at a tie; None of none."""
    return next((shape for shape, _ in Counter(shapes).most_common(1)), None)


def stacked(results: Sequence[Simulation], shape: tuple[int, ...] | None = None) -> np.ndarray:
    """Signals [n, *signal_shape] of n runs, rows of NaN where one failed.

    Args:
        shape: Of one signal where every run failed; None raises then.

    Raises:
        ValueError: signals of several shapes, or none and no `shape`.
    """
    found = {result.signal.shape for result in results if result.signal is not None}
    require(len(found) <= 1, "simulate", "return signals of one shape", sorted(found))
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
    """Simulate all jobs in one call; in several where they name other parameters than those of
    which `BatchSimulator.neutral` has the values that change nothing.

    An exception, taking too long, or returning other than one signal per job costs only the run
    to blame: the batch is then repeated one by one. Seconds are shared out evenly.

    Args:
        shape: Of one signal; None accepts any.
        timeout: Seconds per job that the call may take, see `within`.
    """
    neutral = simulate.neutral if isinstance(simulate, BatchSimulator) else {}
    alike: dict[frozenset[str], list[int]] = {}
    for place, job in enumerate(batch):
        alike.setdefault(frozenset(job.theta.keys() - neutral.keys()), []).append(place)
    found: dict[int, Simulation] = {}
    for places in alike.values():
        part = [batch[place] for place in places]
        made = _one_call(simulate, part, columns(part, neutral), shape, timeout)
        found.update(zip(places, made, strict=True))
    return [found[place] for place in range(len(batch))]


def _one_call(
    simulate: Simulator,
    batch: Sequence[Job],
    arguments: tuple[dict[str, np.ndarray], np.ndarray],
    shape: tuple[int, ...] | None,
    timeout: float | None,
) -> list[Simulation]:
    limit = simulate.time_limit if isinstance(simulate, BatchSimulator | OneByOne) else None
    allowed = None if timeout is None else timeout * len(batch)
    started = time.perf_counter()
    try:
        signals = within(
            allowed, lambda: signals_of(simulate(*arguments), len(batch), shape), limit
        )
    except Overdue as overdue:
        failure, seconds = timed_out(overdue.seconds), overdue.seconds
    # whatever the user's code raises is a failed run, and kept; many programs end by SystemExit
    except (Exception, SystemExit) as error:
        bad = isinstance(error, Unusable)
        failure = misshapen(simulate, batch, shape, error) if bad else raised(error)
        seconds = time.perf_counter() - started
    else:
        seconds = (time.perf_counter() - started) / len(batch)
        return [Simulation(signal, None, seconds) for signal in signals]
    if len(batch) == 1:
        return [Simulation(None, failure, seconds)]
    made = [run_batch(simulate, [job], shape, timeout)[0] for job in batch]
    if is_unusable(failure) and all(is_unusable(one.error) for one in made):
        # no run is right alone either: tell of the call that the user's code got
        return [one._replace(error=failure) for one in made]
    return made


def signals_of(returned: object, n: int, shape: tuple[int, ...] | None) -> np.ndarray:
    """Signals that a simulator returned for n runs, float64 [n, *shape].

    Args:
        shape: Of one signal; None accepts any.

    Raises:
        ValueError: no numbers, or of another shape.
    """
    signals = float64(returned)
    if signals.shape[:1] != (n,) or shape not in (None, signals.shape[1:]):
        raise Unusable(str(signals.shape), signals.shape)
    return signals


def misshapen(
    simulate: Simulator, batch: Sequence[Job], shape: tuple[int, ...] | None, error: Unusable
) -> Failure:
    """The failure of a simulator that returned something else than signals for these jobs."""
    of_which = f" for {batch[0].theta}, seed {batch[0].seed}" if len(batch) == 1 else ""
    if isinstance(simulate, OneByOne):
        # `OneByOne` puts an axis for the one run before the signal's
        got = error.got if error.shape is None else error.shape[1:]
        due = "one signal" if shape is None else f"one signal of shape {shape}"
        called = "with vectorised=False " if type(simulate) is OneByOne else ""
        return unusable(f"{called}simulate must return {due}, got {got}{of_which}")
    due = f"({len(batch)}, ...)" if shape is None else (len(batch), *shape)
    single = error.shape is not None and error.shape == shape
    cure = "; if it makes one run at a time, pass vectorised=False" if single else ""
    return unusable(
        f"simulate must return signals of shape {due}, one row per theta, got {error.got}"
        f"{of_which}{cure}"
    )


def within[R](timeout: float | None, call: Callable[[], R], limit: Limit | None = None) -> R:
    """Return or raise as `call` does, if it does so in `timeout` seconds.

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
            raise Overdue(timeout) from error
    outcome: Future[R] = Future()

    def run() -> None:
        try:
            outcome.set_result(call())
        except BaseException as error:  # for the caller to judge
            outcome.set_exception(error)

    # a daemon does not keep the process from ending
    thread = threading.Thread(target=run, name="simulate", daemon=True)
    thread.start()
    thread.join(min(timeout, threading.TIMEOUT_MAX))
    if not outcome.done():
        raise Overdue(timeout)
    return outcome.result()
