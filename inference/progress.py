"""Progress of long work, on stderr so that stdout stays for results."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Advance = Callable[[int], object]
"""Moves a bar on by so many steps."""


@contextmanager
def progress_bar(
    task: str, total: int, *, shown: bool | Callable[[int], object], done: int = 0
) -> Iterator[Advance]:
    """A bar that the yielded function moves on; one line only where there is no terminal.

    Args:
        task: What is being done, in a few words.
        total: Steps in all.
        shown: False for silence; a function is called with the steps instead.
        done: Steps made before.
    """
    if not isinstance(shown, bool):
        yield shown
        return
    if not shown:
        yield lambda steps: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        console.print(f"{task}: {total - done} to run", highlight=False)
        yield lambda steps: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as bar:
        handle = bar.add_task(task, total=total, completed=done)
        yield lambda steps: bar.advance(handle, steps)
