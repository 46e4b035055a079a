"""Failure messages of simulations, and their classification."""

import os
import traceback
from collections import Counter
from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path


class Failure(StrEnum):
    """Kinds of failed runs, by the word that begins or stands for the sentence that is kept."""

    RAISED = "raised"
    NOT_FINITE = "not finite"  # the simulator returned NaN or infinity
    TIMEOUT = "timeout"
    UNUSABLE = "unusable"  # the simulator returned something else than a signal
    INCOMPARABLE = "incomparable"  # the user's discrepancy or summary failed on the signal
    IMPOSSIBLE = "impossible"  # the log likelihood is -inf


class NoSignals(ValueError):
    """None of the first runs gave a signal, and so none would; the message says what came."""


_ENGINE = f"{Path(__file__).parents[1]}{os.sep}"
_INSTALLED = f"{os.sep}lib{os.sep}python"  # of Python's own modules and of packages


def raised(error: BaseException) -> str:
    """What is kept of an exception: its type's name, its text, and the user's line, if any."""
    try:
        said = str(error)
    except Exception:  # an exception may fail at its own text
        said = "no text"
    text = f"{type(error).__name__}: {said}{_line(error)}"
    return text.encode(errors="backslashreplace").decode()  # file names may hold half characters


def _line(error: BaseException) -> str:
    """The last line of the traceback that is neither the engine's nor an installed package's."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if not frame.filename.startswith(_ENGINE) and _INSTALLED not in frame.filename:
            return f" ({Path(frame.filename).name}, line {frame.lineno})"
    return ""


def timed_out(timeout: float) -> str:
    return f"{Failure.TIMEOUT}: no signal after {timeout:g} s"


def not_finite(what: str) -> str:
    return f"{Failure.NOT_FINITE}: {what}"


def unusable(what: str) -> str:
    return f"{Failure.UNUSABLE}: {what}"


def incomparable(what: str) -> str:
    return f"{Failure.INCOMPARABLE}: {what}"


def impossible(what: str) -> str:
    return f"{Failure.IMPOSSIBLE}: {what}"


def kind(error: str) -> Failure:
    """The kind of a failure of which a sentence is kept."""
    prefix = error.partition(":")[0]
    return next((one for one in Failure if one == prefix), Failure.RAISED)


def count(errors: Iterable[str]) -> dict[str, int]:
    """Failures by kind; kinds that did not occur, and "" for success, are left out."""
    return dict(Counter(kind(error).value for error in errors if error))
