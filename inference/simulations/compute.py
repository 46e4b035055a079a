"""Where simulations are made and kept."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from ..arguments import check_timeout, checked_integer
from .bank import SimulationBank
from .executors import Workers, open_executor


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
        executor: See `open_executor`.
        timeout, batch: See `Compute`.
        bank: A bank, left open, or the path of one.
        one_thread: Whether the simulator serves only one thread of a process.

    Raises:
        ValueError: one of them cannot be used.
        ImportError, ConnectionError: Dask is not installed, or no scheduler answers.
    """
    checked = Compute(None, timeout, batch)
    with ExitStack() as stack:
        if bank is not None and not isinstance(bank, SimulationBank):
            if not isinstance(bank, str | PathLike) or not str(bank):
                due = "the path of a file or a SimulationBank"
                raise ValueError(f"bank must be {due}, got {bank!r:.100}")
            bank = stack.enter_context(SimulationBank(bank))
        workers = stack.enter_context(open_executor(executor, one_thread=one_thread))
        yield replace(checked, executor=workers, bank=bank)
