"""Where a command simulates: the options `--workers`, `--dask` and `--timeout`."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from ..inference.simulations import Compute

WorkersOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Processes that simulate; 1 is this process. Studies and the demo use all processors.",
    ),
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
    dask: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Simulate on the cluster of this scheduler."),
    ] = None
    timeout: Annotated[float | None, typer.Option(help="Seconds that one simulation may take.")] = (
        None
    )

    def __post_init__(self) -> None:
        from ..run.compute import check_timeout

        check_timeout(self.timeout)

    @contextmanager
    def opened(self) -> "Iterator[Compute]":
        """With the executor that `workers` and `dask` name; it is closed afterwards.

        Raises:
            BadParameter: Both are given.
            InputError, ValueError, ImportError, ConnectionError: See `run.compute.open_compute`.
        """
        from ..run.compute import open_compute
        from ..run.workers import processes

        if self.dask is not None and self.workers not in (None, 1):
            raise typer.BadParameter("--workers and --dask name two places to simulate: give one")
        made = processes(self.workers) if self.dask is None else nullcontext(self.dask)
        with made as workers, open_compute(workers, self.timeout) as compute:
            yield compute

    @contextmanager
    def arguments(self) -> "Iterator[dict[str, Any]]":
        """The same as `executor` and `timeout` of a function."""
        with self.opened() as compute:
            yield {"executor": compute.executor, "timeout": compute.timeout}


@dataclass(frozen=True)
class StudyComputeOptions(ComputeOptions):
    """Those of the demo or a long study, which take all processors unless told otherwise."""

    workers: WorkersOption = None
