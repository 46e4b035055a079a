"""Where a command simulates: the options `--workers`, `--dask` and `--timeout`."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..inference.simulations import Compute

WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers",
        min=1,
        help="Processes that simulate; 1 is this process. Studies and the demo use all processors.",
    ),
]
DaskOption = Annotated[
    str | None,
    typer.Option("--dask", metavar="ADDRESS", help="Simulate on the cluster of this scheduler."),
]
TimeoutOption = Annotated[
    float | None, typer.Option("--timeout", help="Seconds that one simulation may take.")
]


@dataclass(frozen=True)
class ComputeOptions:
    """Where simulations run, and for how long at the most.

    Attributes:
        workers: Number of processes; 1 is this process, None one for each processor.
        dask: Address of a Dask scheduler, in place of processes.
        timeout: Seconds that one simulation may take; None sets no limit.
    """

    workers: WorkersOption = 1
    dask: DaskOption = None
    timeout: TimeoutOption = None

    def __post_init__(self) -> None:
        from ..run.compute import check_timeout

        check_timeout(self.timeout)

    @contextmanager
    def opened(self) -> "Iterator[Compute]":
        """With the executor that `workers` and `dask` name; it is closed afterwards."""
        from ..inference.simulations import Compute

        with open_executor_of(self.workers, self.dask) as executor:
            yield Compute(executor, self.timeout)

    @contextmanager
    def arguments(self) -> "Iterator[dict[str, Any]]":
        """The same as `executor` and `timeout` of a function."""
        with self.opened() as compute:
            yield {"executor": compute.executor, "timeout": compute.timeout}


@dataclass(frozen=True)
class StudyComputeOptions(ComputeOptions):
    """Those of the demo or a long study, which take all processors unless told otherwise."""

    workers: WorkersOption = None


@contextmanager
def open_executor_of(workers: int | None, dask: str | None) -> "Iterator[Executor | None]":
    """Processes, a Dask cluster, or None for this process.

    Raises:
        BadParameter: Both are given.
        ValueError: A Dask worker has several threads, of which the fluid can use only one.
        ImportError: Dask is not installed.
        ConnectionError: No scheduler answers there.
    """
    if dask is None:
        from ..run.workers import processes

        with processes(workers) as executor:
            yield executor
        return
    if workers not in (None, 1):
        raise typer.BadParameter("--workers and --dask name two places to simulate: give one")
    from ..run.compute import open_compute

    with open_compute(dask) as compute:
        yield compute.executor
