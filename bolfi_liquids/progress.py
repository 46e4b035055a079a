"""Progress of long work: the engine's bars and phases, and what the application adds."""

from .inference.progress import Advance as Advance
from .inference.progress import phases as phases
from .inference.progress import progress_bar as progress_bar


def silent(steps: int) -> None:
    """Shows nothing."""
