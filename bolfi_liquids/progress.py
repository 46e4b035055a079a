"""Progress of long work, on stderr so that stdout stays for results."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numpy.typing import NDArray

Simulate = Callable[[dict[str, NDArray], NDArray], NDArray]
"""(theta, seeds) -> signals, one row for each seed."""

Advance = Callable[[int], None]


@contextmanager
def progress_bar(task: str, total: int, *, shown: bool) -> Iterator[Advance]:
    """A bar that the yielded function moves on; one line only where there is no terminal.

    Args:
        task: What is being done, in a few words.
        total: Number of steps.
        shown: False for silence.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not shown or not console.is_terminal:
        if shown:
            console.print(f"{task}: {total} to run", highlight=False)
        yield lambda steps: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as bar:
        handle = bar.add_task(task, total=total)
        yield lambda steps: bar.advance(handle, steps)


def reported(simulate: Simulate, advance: Advance) -> Simulate:
    """The same simulator, which moves a bar on after each batch."""

    def simulate_and_report(theta: dict[str, NDArray], seeds: NDArray) -> NDArray:
        signals = simulate(theta, seeds)
        advance(len(seeds))
        return signals

    return simulate_and_report
