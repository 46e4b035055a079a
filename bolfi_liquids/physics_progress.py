"""Progress of one validation case, on stderr so that stdout stays for results."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def case_progress(label: str, *, shown: bool) -> Iterator[Callable[[float], None]]:
    """A bar that the yielded function sets to a fraction; one line where there is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not shown or not console.is_terminal:
        if shown:
            console.print(label, highlight=False)
        yield lambda fraction: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as bar:
        handle = bar.add_task(label, total=1.0)
        yield lambda fraction: bar.update(handle, completed=min(max(fraction, 0.0), 1.0))
        bar.update(handle, completed=1.0)
