"""Why a run of a simulator has no signal that can be learned from."""

import os
import traceback
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TypeGuard


class FailureKind(StrEnum):
    """Kinds of failed runs."""

    RAISED = "raised"
    NOT_FINITE = "not finite"  # the simulator returned NaN or infinity
    TIMEOUT = "timeout"
    UNUSABLE = "unusable"  # the simulator returned something else than a signal
    INCOMPARABLE = "incomparable"  # the user's discrepancy or summary failed on the signal
    IMPOSSIBLE = "impossible"  # the log likelihood is -inf


@dataclass(frozen=True)
class Failure:
    """One failed run.

    Attributes:
        kind: Of the failure.
        text: What happened; of what was raised, its type's name, its text, and the user's line.
    """

    kind: FailureKind
    text: str

    def __str__(self) -> str:
        raised = self.kind is FailureKind.RAISED
        return self.text if raised else f"{self.kind}: {self.text}"


def failure_columns(error: Failure | None) -> tuple[str | None, str | None]:
    """Kind and text as a database keeps them; two None for success."""
    return (None, None) if error is None else (error.kind.value, error.text)


def failure_of(kind: str | None, text: str) -> Failure | None:
    """The failure of two columns, see `failure_columns`."""
    return None if kind is None else Failure(FailureKind(kind), text)


def is_unusable(error: Failure | None) -> TypeGuard[Failure]:
    """Whether the simulator returned something else than a signal."""
    return error is not None and error.kind is FailureKind.UNUSABLE


class NoSignals(ValueError):
    """None of the first runs gave a signal, and so none would; the message says what came."""


_ENGINE = f"{Path(__file__).parents[1]}{os.sep}"
_INSTALLED = f"{os.sep}lib{os.sep}python"  # of Python's own modules and of packages


def raised(error: BaseException) -> Failure:
    """The failure of a run that raised."""
    try:
        said = str(error)
    except Exception:  # an exception may fail at its own text
        said = "no text"
    text = f"{type(error).__name__}: {said}{_line(error)}"
    # file names may hold half characters
    return Failure(FailureKind.RAISED, text.encode(errors="backslashreplace").decode())


def _line(error: BaseException) -> str:
    """The last line of the traceback that is neither the engine's nor an installed package's."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if not frame.filename.startswith(_ENGINE) and _INSTALLED not in frame.filename:
            return f" ({Path(frame.filename).name}, line {frame.lineno})"
    return ""


def timed_out(timeout: float) -> Failure:
    return Failure(FailureKind.TIMEOUT, f"no signal after {timeout:g} s")


not_finite = partial(Failure, FailureKind.NOT_FINITE)
unusable = partial(Failure, FailureKind.UNUSABLE)
incomparable = partial(Failure, FailureKind.INCOMPARABLE)
impossible = partial(Failure, FailureKind.IMPOSSIBLE)
