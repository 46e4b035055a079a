"""Processes that share long work."""

import os
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context


def processors() -> int:
    """Of this machine."""
    return os.cpu_count() or 1


@contextmanager
def processes(count: int | None = None) -> Iterator[Executor | None]:
    """Processes to work in; None, which is this process, where one is enough.

    They are spawned, since JAX does not survive a fork.

    Args:
        count: How many; None is one for each processor.
    """
    count = count or processors()
    if count == 1:
        yield None
        return
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        yield pool
