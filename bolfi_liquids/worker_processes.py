"""Processes that share long work."""

import os
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.process import BaseProcess
from threading import Thread


@contextmanager
def processes(count: int | None = None) -> Iterator[Executor | None]:
    """Processes to work in; None, which is this process, where one is enough.

    They are spawned, since JAX does not survive a fork.

    Args:
        count: How many; None is one for each processor.
    """
    count = count or os.cpu_count() or 1
    if count == 1:
        yield None
        return
    spawn = get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=spawn, initializer=_end_with_parent) as pool:
        yield pool


def _end_with_parent() -> None:
    """End this process when the one that started it is gone, be it by `kill -9`."""

    def follow(parent: BaseProcess) -> None:
        parent.join()
        os._exit(1)

    if parent := parent_process():
        Thread(target=follow, args=(parent,), daemon=True).start()
