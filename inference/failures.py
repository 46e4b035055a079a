"""Why a simulation failed: a sentence per simulation, of which the kind can be told."""

from collections import Counter
from collections.abc import Iterable

RAISED, NOT_FINITE, TIMEOUT = "raised", "not finite", "timeout"
"""Kinds: the simulator raised; it returned NaN or infinity; it took too long."""


def raised(error: BaseException) -> str:
    """What is kept of an exception: its type's name and its text."""
    text = f"{type(error).__name__}: {error}"
    return text.encode(errors="backslashreplace").decode()  # file names may hold half characters


def timed_out(timeout: float) -> str:
    return f"{TIMEOUT}: no signal after {timeout:g} s"


def not_finite(what: str) -> str:
    return f"{NOT_FINITE}: {what}"


def kind(error: str) -> str:
    """`RAISED`, `NOT_FINITE` or `TIMEOUT`, of a sentence made above."""
    prefix = error.partition(":")[0]
    return prefix if prefix in (NOT_FINITE, TIMEOUT) else RAISED


def count(errors: Iterable[str]) -> dict[str, int]:
    """Failures by kind; kinds that did not occur, and "" for success, are left out."""
    return dict(Counter(kind(error) for error in errors if error))
