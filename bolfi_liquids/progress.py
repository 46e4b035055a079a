"""Progress of long work, on stderr so that stdout stays for results."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .inference.progress import Advance as Advance
from .inference.progress import progress_bar as progress_bar


def silent(steps: int) -> None:
    """Shows nothing."""


def after_first(kept: int, advance: Advance) -> Advance:
    """`advance`, ignoring the first `kept` steps, which the bar already counts."""
    passed = 0

    def later(steps: int) -> None:
        nonlocal passed
        before, passed = passed, passed + steps
        if (new := passed - max(kept, before)) > 0:
            advance(new)

    return later


@contextmanager
def phases(*, shown: bool) -> Iterator[Callable[[str, int], None]]:
    """The phase of long work with a running count of simulations.

    Without a terminal, one line for each phase.

    Yields:
        Called with the phase and the simulations finished in it since the last call.
    """
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True, quiet=not shown)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    count, current = 0, ""
    # a display takes over stdout and stderr even where the console is quiet
    with Progress(*columns, console=console, disable=not (shown and console.is_terminal)) as bar:
        handle = bar.add_task("starting", total=None)

        def report(phase: str, finished: int) -> None:
            nonlocal count, current
            if phase != current and not console.is_terminal:
                console.print(f"{phase} (after {count} simulations)", highlight=False)
            count += finished
            current = phase
            bar.update(handle, description=f"{phase} ({count} simulations)")

        yield report
