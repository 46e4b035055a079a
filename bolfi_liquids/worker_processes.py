"""Processes that share long work."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.process import BaseProcess
from threading import Thread


@contextmanager
def processes(count: int | None = None) -> Iterator[Executor | None]:
    """Processes to work in; None, which is this process, where one is enough.

    They are spawned, since JAX does not survive a fork. What they have not finished when the
    `with` is left by an error, or by Ctrl-C, is given up.

    Args:
        count: How many; None is one for each processor.
    """
    count = count or os.cpu_count() or 1
    if count == 1:
        yield None
        return
    others = active_children()
    spawn = get_context("spawn")
    pool = ProcessPoolExecutor(count, mp_context=spawn, initializer=_follow_parent)
    try:
        yield pool
    except BaseException:
        for worker in set(active_children()).difference(others):
            worker.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _follow_parent() -> None:
    """End this process, without a word, on Ctrl-C, unless that is ignored as in the background of a
    script, and when the one that started it is gone, be it by `kill -9`."""

    def follow(parent: BaseProcess) -> None:
        parent.join()
        os._exit(1)

    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    if parent := parent_process():
        Thread(target=follow, args=(parent,), daemon=True).start()
