"""Where simulations run: any `concurrent.futures.Executor`, or a Dask cluster."""

import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, Protocol, cast, runtime_checkable


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
    with _opened(executor) as opened:
        if one_thread:
            _check_one_thread(opened)
        yield opened


@contextmanager
def _opened(executor: Workers | None) -> Iterator[Executor | None]:
    if isinstance(executor, str):
        with _dask(executor) as found:
            yield found
        return
    if isinstance(executor, DaskClient) and not isinstance(executor, Executor | type):
        yield executor.get_executor(pure=False)
        return
    check_executor(executor)
    yield cast(Executor | None, executor)


def check_executor(executor: object) -> None:
    """Raise ValueError unless simulations can run there; whether a scheduler answers is not
    asked."""
    if executor is None or (isinstance(executor, DaskClient) and not isinstance(executor, type)):
        return
    if not isinstance(executor, Executor | str):
        raise ValueError(
            "executor must be a concurrent.futures.Executor, a Dask client, the address of a Dask "
            f"scheduler or None, got {executor!r:.100} of type {type(executor).__name__}"
        )
    if isinstance(executor, ProcessPoolExecutor) and _forks(executor):
        raise ValueError(
            "executor starts its workers by fork, which JAX's threads do not survive; give "
            "ProcessPoolExecutor(n, mp_context=multiprocessing.get_context('spawn'))"
        )


def _check_one_thread(executor: Executor | None) -> None:
    if isinstance(executor, ThreadPoolExecutor):
        raise ValueError(
            "executor is a pool of threads, but the simulator serves only one thread of a process; "
            "give ProcessPoolExecutor(n, mp_context=multiprocessing.get_context('spawn'))"
        )
    for worker, threads in _dask_threads(executor).items():
        if threads > 1:
            raise ValueError(
                f"the Dask worker {worker} has {threads} threads, but the simulator serves only "
                "one thread of a process; start workers by `dask worker ADDRESS --nthreads 1`, or "
                "LocalCluster(threads_per_worker=1)"
            )


def _dask_threads(executor: Executor | None) -> dict[str, int]:
    """Threads of each worker that has joined a Dask executor's cluster; none of other executors."""
    client = getattr(executor, "_client", None)  # there is no public way
    return client.nthreads() if isinstance(client, DaskClient) else {}


def _forks(pool: ProcessPoolExecutor) -> bool:
    # there is no public way to ask, and the default on Linux, up to Python 3.13, hangs at times
    context = getattr(pool, "_mp_context", None)
    return context is not None and context.get_start_method() == "fork"


@contextmanager
def _dask(address: str) -> Iterator[Executor]:
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
        # impure: a simulation that is asked for again failed before, and is to be tried again
        yield client.get_executor(pure=False)


def workers_of(executor: Executor) -> int | None:
    """Of a pool on this computer; None of others, such as clusters, whose workers die alone."""
    pool = isinstance(executor, ProcessPoolExecutor | ThreadPoolExecutor)
    return getattr(executor, "_max_workers", None) if pool else None  # there is no public way


def killed_its_worker(error: BaseException) -> bool:
    """Whether Dask gave a simulation up, because each worker that tried it died."""
    distributed = sys.modules.get("distributed")
    return distributed is not None and isinstance(error, distributed.KilledWorker)
