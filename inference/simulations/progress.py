"""A bar for long work, on request."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn


@contextmanager
def progress_bar(
    task: str, total: int, *, shown: bool, done: int = 0
) -> Iterator[Callable[[int], None]]:
    """A bar that the yielded function moves on by so many steps.

    Args:
        task: What is counted.
        total: Steps in all.
        shown: False for silence.
        done: Steps made before.
    """
    columns = TextColumn(task), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, disable=not shown) as bar:
        handle = bar.add_task("", total=total, completed=done)
        yield lambda steps: bar.advance(handle, steps)
