"""Where simulations run, and for how long at the most."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from ..errors import Argument, InputError

if TYPE_CHECKING:
    from ..inference import SimulationBank
    from ..inference.simulations import Keep, Workers


class Compute(NamedTuple):
    """How simulations are made. Only `timeout` can change a result: a simulation that takes longer
    is a failed one.

    Attributes:
        executor, timeout, progress: See `calibrate`; the executor is open.
    """

    executor: Executor | None = None
    timeout: float | None = None
    progress: bool = True

    def keep(self, bank: "SimulationBank", identity: str = "", batch: int | None = None) -> "Keep":
        """Simulations made in this way and kept in `bank`.

        Args:
            bank: Takes them.
            identity: The simulator's name in the bank.
            batch: Simulations in one call where there is no executor; None is all of them.
        """
        from ..inference.simulations import Keep

        return Keep(bank, identity, batch, self.executor, self.timeout)


HERE = Compute()
"""In this process, without a limit, with bars."""


@contextmanager
def open_compute(
    workers: "Workers | None", timeout: float | None = None, *, progress: bool = True
) -> Iterator[Compute]:
    """Check and open the workers, before anything is written.

    Args:
        workers: Of processes with one thread each: a pool, a Dask client or the address of a Dask
            scheduler; None is this process.
        timeout: Seconds that one simulation may take; None sets no limit.
        progress: Whether to show bars on stderr.

    Raises:
        InputError: `timeout` is no positive number.
        ValueError: `workers` is something else, or has several threads in a process.
        ImportError, ConnectionError: Dask is not installed, or no scheduler answers.
    """
    from ..inference.simulations import open_executor

    check_timeout(timeout)
    with open_executor(workers, one_thread=True) as executor:
        yield Compute(executor, timeout, progress)


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
