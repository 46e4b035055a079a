"""Progress of long work: the engine's bars and phases, and what the application adds."""

from .inference.progress import Advance as Advance
from .inference.progress import phases as phases
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
