"""Progress of long work, on stderr so that stdout stays for results."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Advance = Callable[[int], object]
"""Moves a bar on by so many steps."""

Report = Callable[[str, int, int], object]
"""(phase, steps finished in it since the last call, steps in it)"""

LINES_APART = 60.0  # s between lines of one phase, where there is no terminal


@contextmanager
def phases(*, shown: bool, bound: str = "") -> Iterator[Report]:
    """A bar for the phase that long work is in.

    Without a terminal: a line (`pouring, 0 of 64`) for each phase, and another every minute.

    Args:
        shown: False for silence.
        bound: "at least" or "at most", where a phase may turn out to need more or fewer steps than
            it begins with.
    """
    if not shown:
        yield lambda phase, finished, total: None
        return
    from rich.console import Console

    console = Console(stderr=True)
    current, done = "", 0
    lines = _lines(console, f"of {bound}".strip())
    with _bar(console) if console.is_terminal else lines as show:

        def report(phase: str, finished: int, total: int) -> None:
            nonlocal current, done
            done = finished if phase != current else done + finished
            current = phase
            show(phase, done, max(done, total))

        yield report


@contextmanager
def progress_bar(
    task: str,
    total: int,
    *,
    shown: bool | Callable[[int], object],
    done: int = 0,
    bound: str = "",
) -> Iterator[Advance]:
    """The same for work of one phase; the yielded function moves the bar on.

    Args:
        task: What is being done, in a few words.
        total: Steps in all.
        shown: False for silence; a function is called with the steps instead.
        done: Steps made before.
        bound: See `phases`.
    """
    if not isinstance(shown, bool):
        yield shown
        return
    with phases(shown=shown, bound=bound) as report:
        report(task, done, total)
        yield lambda steps: report(task, steps, total)


@contextmanager
def _bar(console: Any) -> Iterator[Report]:
    """A bar, which begins anew with each phase."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    text = TextColumn("{task.description}")
    columns = text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console) as bar:
        handle = bar.add_task("starting", total=None)

        def show(phase: str, done: int, total: int) -> None:
            bar.update(handle, description=phase, completed=done, total=total)

        yield show


@contextmanager
def _lines(console: Any, of: str) -> Iterator[Report]:
    """A line where a phase begins, and where the last one is old."""
    current, last = "", 0.0

    def show(phase: str, done: int, total: int) -> None:
        nonlocal current, last
        now = time.monotonic()
        if phase != current or now - last > LINES_APART:
            console.print(f"{phase}, {done} {of} {total}", highlight=False)
            current, last = phase, now

    yield show
