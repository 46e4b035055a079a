"""Where simulations run: any `concurrent.futures.Executor`, or a Dask cluster."""

import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import Any, Protocol, runtime_checkable


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
        opened = _checked(given)
        if one_thread:
            _check_one_thread(opened)
        yield opened


def _checked(executor: object) -> Executor | None:
    """The executor, or ValueError if no simulations can run there."""
    if not isinstance(executor, Executor | None):
        raise ValueError(
            "executor must be a concurrent.futures.Executor, a Dask client, the address of a Dask "
            f"scheduler or None, got {executor!r:.100} of type {type(executor).__name__}"
        )
    if isinstance(executor, ProcessPoolExecutor) and _forks(executor):
        raise ValueError(
            "executor starts its workers by fork, which JAX's threads do not survive; give "
            "ProcessPoolExecutor(n, mp_context=multiprocessing.get_context('spawn'))"
        )
    return executor


def _check_one_thread(executor: Executor | None) -> None:
    if isinstance(executor, ThreadPoolExecutor):
        raise ValueError(
            "executor is a pool of threads, but the simulator serves only one thread of a process; "
            "give ProcessPoolExecutor(n, mp_context=multiprocessing.get_context('spawn'))"
        )
    client = getattr(executor, "_client", None)  # of Dask's executor; there is no public way
    for worker, threads in client.nthreads().items() if isinstance(client, DaskClient) else ():
        if threads > 1:
            raise ValueError(
                f"the Dask worker {worker} has {threads} threads, but the simulator serves only "
                "one thread of a process; start workers by `dask worker ADDRESS --nthreads 1`, or "
                "LocalCluster(threads_per_worker=1)"
            )


def _forks(pool: ProcessPoolExecutor) -> bool:
    # there is no public way to ask, and the default on Linux, up to Python 3.13, hangs at times
    context = getattr(pool, "_mp_context", None)
    return context is not None and context.get_start_method() == "fork"


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
