"""Where simulations run, and for how long at the most: checked and opened for a command."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ..errors import Argument, InputError

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
    from ..inference import simulations

    check_timeout(timeout)
    with simulations.open_compute(workers, timeout, one_thread=True) as compute:
        yield compute


def check_timeout(timeout: float | None) -> None:
    """Raise `InputError` unless it is a positive number of seconds, or None."""
    from ..inference import arguments

    try:
        arguments.check_timeout(timeout)
    except ValueError as refused:
        raise InputError(
            f"{timeout!r:.80}",
            where=Argument("timeout"),
            fix="give a positive number of seconds, or none",
        ) from refused
