"""Where simulations run, and for how long at the most: processes, and what may be given instead.

Not by loky: with 3.7.0, workers go on for at least 20 s after their parent is killed.
"""

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.process import BaseProcess
from threading import Thread
from typing import TYPE_CHECKING

from ..errors import Argument, InputError
from ..models.runtime import THREADS

if TYPE_CHECKING:
    from ..inference.simulations import Compute, Workers


@contextmanager
def open_compute(workers: "Workers | None", timeout: float | None = None) -> "Iterator[Compute]":
    """Check and open the workers, before anything is written; the bank is the run's.

    Args:
        workers: Of processes with one thread each: a pool, a Dask client or the address of a Dask
            scheduler; None is this process.
        timeout: Seconds that one simulation may take; None sets no limit.

    Raises:
        InputError: `timeout` is no positive number.
        ValueError: `workers` is something else, or has several threads in a process.
        ImportError, ConnectionError: Dask is not installed, or no scheduler answers.
    """
    from ..inference import arguments, simulations

    try:
        arguments.check_timeout(timeout)
    except ValueError as refused:
        fix = "give a positive number of seconds, or none"
        raise InputError(f"{timeout!r:.80}", where=Argument("timeout"), fix=fix) from refused
    with simulations.open_compute(workers, timeout, one_thread=True) as compute:
        yield compute


@contextmanager
def processes(count: int | None = None) -> Iterator[Executor | None]:
    """Start worker processes; yield None, for this process, where one is enough.

    They are spawned, since JAX does not survive a fork. The `with` waits for their work; when it
    is left by an error, or by Ctrl-C, what they have not finished is given up.

    Args:
        count: How many; None is one for each processor.
    """
    processors = os.cpu_count() or 1
    count = count or processors
    if count == 1:
        yield None
        return
    with _pool(count, _begin, max(1, processors // count)) as pool:
        yield pool
        pool.shutdown()


@contextmanager
def background_process(niceness: int) -> Iterator[Executor]:
    """Start one worker process that gives way to others. Its work is given up when the `with` ends.

    It is spawned, and ignores Ctrl-C, which the process that started it handles.

    Args:
        niceness: How much is added to the niceness of this process.
    """
    with _pool(1, _begin_behind, niceness) as pool:
        yield pool


@contextmanager
def _pool(count: int, begin: Callable[[int], None], number: int) -> Iterator[Executor]:
    """Spawned processes; what they have not finished at the end is given up."""
    spawn = get_context("spawn")
    pool = ProcessPoolExecutor(count, mp_context=spawn, initializer=begin, initargs=(number,))
    try:
        yield pool
    finally:
        # there is no public way before Python 3.14
        for worker in list((pool._processes or {}).values()):
            worker.terminate()
        pool.shutdown(cancel_futures=True)


def _begin(threads: int) -> None:
    """Simulate by so many threads, and exit silently on Ctrl-C, unless SIGINT is ignored, and when
    the parent process ends."""
    # a process that takes all processors spreads few simulations over all, half of its lanes empty
    os.environ.setdefault(THREADS, str(threads))
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    _end_with_parent()


def _begin_behind(niceness: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(niceness)
    _end_with_parent()


def _end_with_parent() -> None:
    """Exit silently when the parent process ends, even by `kill -9`."""

    def follow(parent: BaseProcess) -> None:
        parent.join()
        os._exit(1)

    if parent := parent_process():
        Thread(target=follow, args=(parent,), daemon=True).start()
