"""How simulations are made."""

from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..inference import SimulationBank
    from ..inference.simulations import Keep


class Execution(NamedTuple):
    """How simulations are made. Only `timeout` can change a result: a simulation that takes longer
    is a failed one.

    Attributes:
        executor: Shares the work; None is this process.
        timeout: Seconds that one simulation may take; None sets no limit.
        progress: Whether to show bars on stderr.
    """

    executor: Executor | None = None
    timeout: float | None = None
    progress: bool = True

    @property
    def local(self) -> bool:
        """Whether all work is done on this computer, where this process's files are."""
        return self.executor is None or isinstance(
            self.executor, ProcessPoolExecutor | ThreadPoolExecutor
        )

    def keep(self, bank: "SimulationBank", identity: str = "", batch: int | None = None) -> "Keep":
        """Simulations made in this way and kept in `bank`.

        Args:
            bank: Takes them.
            identity: The simulator's name in the bank.
            batch: Simulations in one call where there is no executor; None is all of them.
        """
        from ..inference.simulations import Keep

        return Keep(bank, identity, batch, self.executor, self.timeout)

    def of_a_worker(self) -> "Execution":
        """For a job of the executor: it simulates in its own process and shows no bars."""
        return Execution(None, self.timeout, progress=False)


HERE = Execution()
"""In this process, without a limit, with bars."""
