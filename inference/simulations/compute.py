"""Where simulations are made and kept: an executor or a Dask cluster, a timeout, a bank."""

import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from ..arguments import check_timeout, checked_integer, require
from .bank import SimulationBank

SPAWNING = "give ProcessPoolExecutor(n, mp_context=multiprocessing.get_context('spawn'))"


@runtime_checkable
class DaskClient(Protocol):
    """`distributed.Client`, as far as it is used here."""

    def get_executor(self, **options: Any) -> Executor:
        """An executor that submits to the client's cluster."""
        ...

    def nthreads(self) -> dict[str, int]:
        """Threads of each worker, by its address."""
        ...


Workers = Executor | DaskClient | str
"""An executor, a Dask client, or the address of a Dask scheduler."""


@dataclass(frozen=True)
class Compute:
    """Where simulations are made and kept. Only `timeout` can change a result: a simulation that
    takes longer is a failed one.

    Attributes:
        executor: Simulates each job in a call of its own; a pool as many as
            `BatchSimulator.together` says; None simulates in this process.
        timeout: Seconds that one simulation may take, those of one call together as many times
            as long; None sets no limit.
        batch: Simulations in one call of the simulator, and kept together, where there is no
            executor; None is all of them.
        bank: Takes every finished simulation; what it holds is not simulated again. None forgets
            them when the call ends.

    Raises:
        ValueError: a batch or timeout that is not positive.
    """

    executor: Executor | None = None
    timeout: float | None = None
    batch: int | None = None
    bank: SimulationBank | None = None

    def __post_init__(self) -> None:
        check_timeout(self.timeout)
        if self.batch is not None:
            checked_integer("batch", self.batch)


@contextmanager
def open_compute(
    executor: Workers | None = None,
    timeout: float | None = None,
    batch: int | None = None,
    bank: str | Path | SimulationBank | None = None,
    *,
    one_thread: bool = False,
) -> Iterator[Compute]:
    """Check and open what a user gives; what is opened here is closed.

    Args:
        executor: See `fit`.
        timeout, batch: See `Compute`.
        bank: A bank, left open, or the path of one.
        one_thread: Whether the simulator serves only one thread of a process.

    Raises:
        ValueError: one of them cannot be used.
        ImportError, ConnectionError: Dask is not installed, or no scheduler answers.
    """
    checked = Compute(None, timeout, batch)
    usable = bank is None or isinstance(bank, PathLike | SimulationBank | str) and bank != ""
    require(usable, "bank", "be the path of a file or a SimulationBank", bank)
    with ExitStack() as stack:
        if bank is not None and not isinstance(bank, SimulationBank):
            bank = stack.enter_context(SimulationBank(bank))
        workers = stack.enter_context(open_executor(executor, one_thread=one_thread))
        yield replace(checked, executor=workers, bank=bank)


@contextmanager
def open_executor(
    executor: Workers | None, *, one_thread: bool = False
) -> Iterator[Executor | None]:
    """The executor itself, or a Dask client's, left open; or one at a Dask scheduler's address,
    closed afterwards.

    Args:
        executor: As a user gives it; None is this process.
        one_thread: Whether the simulator serves only one thread of a process.

    Raises:
        ValueError: none of them, a process pool that forks, or one that `one_thread` forbids.
        ImportError: an address, but Dask is not installed.
        ConnectionError: no scheduler answers there.
    """
    with ExitStack() as stack:
        given: object = executor
        if isinstance(given, str):
            given = stack.enter_context(_dask_client(given))
        if isinstance(given, DaskClient) and not isinstance(given, Executor | type):
            # impure: a simulation that is asked for again failed before, and is to be tried again
            given = given.get_executor(pure=False)
        if not isinstance(given, Executor | None):
            raise ValueError(
                "executor must be a concurrent.futures.Executor, a Dask client, the address of a "
                f"Dask scheduler or None, got {given!r:.100} of type {type(given).__name__}"
            )
        # there is no public way to ask, and the default on Linux, up to Python 3.13, hangs at times
        context = given._mp_context if isinstance(given, ProcessPoolExecutor) else None
        forks = context is not None and context.get_start_method() == "fork"
        due = "start no workers by fork, which JAX's threads do not survive"
        require(not forks, "executor", due, given, cure=SPAWNING)
        if one_thread:
            _check_one_thread(given)
        yield given


def _check_one_thread(executor: Executor | None) -> None:
    due = "be no threads, for the simulator serves only one of a process"
    threaded = isinstance(executor, ThreadPoolExecutor)
    require(not threaded, "executor", due, executor, cure=SPAWNING)
    client = getattr(executor, "_client", None)  # of Dask's executor; there is no public way
    for worker, threads in client.nthreads().items() if isinstance(client, DaskClient) else ():
        if threads > 1:
            raise ValueError(
                f"the Dask worker {worker} has {threads} threads, but the simulator serves only "
                "one thread of a process; start workers by `dask worker ADDRESS --nthreads 1`, or "
                "LocalCluster(threads_per_worker=1)"
            )


@contextmanager
def _dask_client(address: str) -> Iterator[Any]:
    """A client of the scheduler there, closed afterwards."""
    try:
        from distributed import Client  # pyright: ignore[reportMissingImports]
    except ModuleNotFoundError as err:
        raise ImportError(
            f"simulating on the Dask scheduler {address!r} needs: pip install 'bolfi-liquids[dask]'"
        ) from err
    try:
        client = Client(address)
    except (OSError, ValueError) as err:
        raise ConnectionError(
            f"no Dask scheduler answers at {address!r}; give the address of one that runs, such "
            f"as tcp://host:8786, or an executor itself: {err}"
        ) from err
    with client:
        yield client


def is_pool(executor: Executor) -> bool:
    """Whether it is a pool on this computer; of others, such as clusters, workers die alone."""
    return isinstance(executor, ProcessPoolExecutor | ThreadPoolExecutor)


def killed_its_worker(error: BaseException) -> bool:
    """Whether Dask gave a simulation up, because each worker that tried it died."""
    distributed = sys.modules.get("distributed")
    return distributed is not None and isinstance(error, distributed.KilledWorker)
