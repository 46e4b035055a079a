"""The one place that starts Taichi."""

import contextlib
import io
import math
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

# read when Taichi is imported, which prints otherwise: its version, and, under a progress bar, that
# it takes the wrapped stdout for a notebook's
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
os.environ.setdefault("TI_ENABLE_PYBUF", "0")

THREADS = "TI_CPU_MAX_NUM_THREADS"  # Taichi's variable
STALE_S = 60.0  # age of a lock that is held for a moment
CHUNK = 40  # steps in one call of a kernel, a quarter of a second: Ctrl-C waits for its end


class WrongThread(RuntimeError):
    """A thread wants to simulate that did not start Taichi."""


class ForeignTaichi(RuntimeError):
    """Other code has started Taichi in this process."""


class OneThread:
    """A lock that, once it has an owner, only this thread may take, and only while Taichi runs as
    the owner found it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._owner: threading.Thread | None = None
        self._taichi: Any = None

    def own(self) -> None:
        """Make the calling thread the owner."""
        self._owner, self._taichi = threading.current_thread(), _taichi()

    def __enter__(self) -> None:
        self._lock.acquire()
        # idents of threads that have ended are used again
        if self._owner is not None and self._owner is not threading.current_thread():
            self._lock.release()
            raise WrongThread(
                f"Taichi was started in the thread {self._owner.name!r} and works in no other; "
                "simulate in processes of one thread each, such as ProcessPoolExecutor's or those "
                "of `dask worker ADDRESS --nthreads 1`"
            )
        if self._owner is not None and self._taichi is not _taichi():
            self._lock.release()
            raise ForeignTaichi(
                "Taichi was started or reset by other code after a simulation, which has deleted "
                f"the simulator's fields; {APART}"
            )

    def __exit__(self, *_: object) -> None:
        self._lock.release()


NO_TAICHI = (
    "the fluid needs Taichi, which has no package for Python 3.14 and later; use Python 3.12 or "
    "3.13, or the inference alone, which works without it"
)
APART = (
    "Taichi has one state in a process: simulate in another process than code that calls ti.init, "
    "such as one of a ProcessPoolExecutor with the start method 'spawn'"
)


def _taichi() -> Any:
    """Taichi's state in this process: another object after each ti.init or ti.reset."""
    from taichi.lang import impl

    return impl.get_runtime()


LOCK = OneThread()
"""Held while a scene runs: Taichi compiles only in the thread that started it, and fails for good
where another one tries."""


_ends: ContextVar[float] = ContextVar("ends", default=math.inf)  # of `time.monotonic`


class TimeLimitExceeded(TimeoutError):
    """A simulation took longer than `time_limit` allowed."""


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Inside, simulations of this thread that take longer raise.

    They stop between two kernel calls, and leave the simulator as usable as before. A thread
    that is abandoned would keep it, and Taichi compiles only in the thread that started it.

    Raises:
        TimeLimitExceeded: `seconds` were over.
    """
    token = _ends.set(min(_ends.get(), time.monotonic() + seconds))
    try:
        yield
    finally:
        _ends.reset(token)


def check_time_limit(done: int, steps: int) -> None:
    """To be called between kernel calls, after `done` of `steps` steps.

    Raises:
        TimeLimitExceeded: the time of `time_limit` is over.
    """
    if time.monotonic() > _ends.get():
        raise TimeLimitExceeded(f"stopped after {done} of {steps} steps")


class Watch(NamedTuple):
    """An observer of a running scene, in which it changes nothing.

    Attributes:
        rate: Looks per second of the simulation, besides those at its start and at its end.
        look: (scene, steps done); called between two kernel calls.
    """

    rate: float
    look: Callable[[Any, int], None]


def run_chunks(scene, steps: int, run: Callable[[int, int], None], watch: Watch | None) -> None:
    """Call `run(start, stop)` until `steps` steps of a scene are done.

    Where one call ends and the next begins changes no bit, so neither does a watch.

    Raises:
        TimeLimitExceeded: the time of `time_limit` is over.
    """
    looks = set[int]()
    if watch is not None:
        every = max(scene.rate / watch.rate, 1.0)
        looks = {steps, *(int(step) for step in np.rint(np.arange(0.0, steps, every)))}
        watch.look(scene, 0)
    for begin, end in pairwise(sorted({0, *range(0, steps, CHUNK), *looks, steps})):
        check_time_limit(begin, steps)
        run(begin, end)
        if watch is not None and end in looks:
            watch.look(scene, end)


def remove_stale_lock(folder: Path) -> None:
    """Of Taichi's cache of kernels: a process that is killed while it writes there leaves the lock,
    and every later one compiles for itself."""
    lock = folder / "ticache.lock"
    with contextlib.suppress(OSError):
        if time.time() - lock.stat().st_mtime > STALE_S:
            lock.unlink()


@cache
def start() -> None:
    """Start Taichi on the CPU; later calls in the same process do nothing.

    Taichi keeps its settings for the life of a process, so other settings need another process.

    Raises:
        ForeignTaichi: other code has started it, whose fields this would delete.
        ImportError: it is not installed.
    """
    try:
        import taichi as ti
    except ModuleNotFoundError as missing:
        raise ImportError(NO_TAICHI) from missing
    from taichi.lang.impl import default_cfg

    if _taichi().prog is not None:
        raise ForeignTaichi(f"Taichi was started by other code before the simulator; {APART}")

    remove_stale_lock(Path(default_cfg().offline_cache_file_path))
    # Fast arithmetic would let the compiler split sums as it likes, and a simulation's bits depend
    # on its company. The banner is a bare print that no log level silences.
    # Taichi's own optimisations double the time to compile; LLVM's alone make code as fast.
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(
            arch=ti.cpu,
            default_fp=ti.f32,
            fast_math=False,
            advanced_optimization=False,
            log_level=ti.ERROR,
        )
    LOCK.own()
