"""What commands write to stderr: notices, and errors in one line of what a person can mend."""

import errno
import logging
import os
import sqlite3
import sys
import traceback
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException

from ..errors import InputError, one_line
from ..files import disk_errno
from ..wording import command

FAILED = 1
USAGE_ERROR = 2
ABORTED = 3  # something ended a recording early; what there is was kept
INTERRUPTED = 130  # 128 + SIGINT, as shells report it
GIVEN = "bolfi_liquids.given"  # key of the arguments as they were typed
PACKAGE = "bolfi_liquids"


class Aborted(RuntimeError):
    """A recording was ended early, and what there is was kept.

    Args:
        reason: What ended it.
        status: Of the command.
    """

    def __init__(self, reason: str, status: int = ABORTED):
        super().__init__(reason)
        self.status = status


class OneLineErrors(TyperGroup):
    """A command group that turns expected errors into one line on stderr.

    The exit code is 2 for what a person gave and can mend, and 1 for simulations that failed.
    One that records has 3 for a recording that was aborted.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        ctx.meta[GIVEN] = list(args)
        try:
            return super().parse_args(ctx, args)
        except TyperException as err:
            raise _misused(err) from None

    def invoke(self, ctx: Any) -> Any:
        try:
            _check_none_empty(ctx.meta[GIVEN])
            _check_none_twice(ctx.meta[GIVEN], self._typed(ctx))
            return super().invoke(ctx)
        except KeyboardInterrupt:
            say(how_to_go_on(sys.argv[1:]))
            raise typer.Exit(INTERRUPTED) from None
        except (typer.Exit, typer.Abort):  # RuntimeErrors by descent, but no errors
            raise
        except TyperException as err:
            raise _misused(err) from None
        except BrokenPipeError:  # who reads has read enough, as `head` does: typer ends quietly
            raise
        except (ValueError, OSError, RuntimeError, ImportError, sqlite3.Error) as err:
            if ctx.params.get("debug"):
                traceback.print_exc()
            own = isinstance(err, InputError)
            names = {option.name: option.opts[0] for option in self._typed(ctx)}
            say(f"error: {err.as_typed(names) if own else explained(err)}")
            failed = FAILED if isinstance(err, RuntimeError) else USAGE_ERROR
            raise typer.Exit(getattr(err, "status", failed)) from None

    def _typed(self, ctx: Any) -> list[Any]:
        """Options of the command that was typed."""
        typed: Any = self
        for word in ctx.meta[GIVEN]:
            typed = getattr(typed, "commands", {}).get(word, typed)
        return [one for one in typed.params if one.opts[0].startswith("--")]


def _misused(err: TyperException) -> typer.Exit:
    """Exit of a mistyped command; a group without a command shows its help."""
    message = err.format_message()
    if message.startswith("Usage:"):
        typer.echo(message)
    else:
        rule = message.replace(": Value error, ", ": ", 1).rstrip(".")
        say(f"error: {rule}; see --help")
    return typer.Exit(USAGE_ERROR)


def _check_none_empty(arguments: list[str]) -> None:
    """Refuse empty arguments: as a path one would mean the current directory."""
    for option, value in _values(arguments):
        if not value.strip():
            named = option if option.startswith("-") else "an argument"
            raise InputError("is empty", where=named, fix="give a value; was a variable not set?")


def _check_none_twice(arguments: list[str], options: list[Any]) -> None:
    """Refuse an option of one value that is repeated: click would drop all but the last."""
    typed = [argument.partition("=")[0] for argument in arguments]
    for option in options:
        if typed.count(option.opts[0]) > 1 and not (option.multiple or option.is_flag):
            raise InputError("is given twice", where=option.opts[0], fix="give it once")


def _values(arguments: list[str]) -> Iterator[tuple[str, str]]:
    """Each argument, as a value of the option in it or before it."""
    for before, argument in pairwise(["", *arguments]):
        option, given, value = argument.partition("=")
        own = given and option.startswith("--")
        yield (option, value) if own else (before, argument)


def explained(err: Exception) -> str:
    """Text of an error and, where the disk or a file refused, its cure."""
    if (number := disk_errno(err)) is not None:
        where = getattr(err, "filename", None) or "a file that the command writes"
        cure = "make it writable" if number == errno.EROFS else "make room"
        return (
            f"{where}: {os.strerror(number)}; {cure}, then repeat the command (calibrate with "
            "--resume): nothing that was simulated is lost"
        )
    if isinstance(err, OSError) and err.filename is not None:
        return f"{err.filename}: {err.strerror}; choose a place that can be read and written"
    return str(err)


def how_to_go_on(arguments: list[str]) -> str:
    """Sentence that says how an interrupted command, typed so, goes on."""
    from ..run.run import RUN_TOML

    again, begun = command(*arguments), True
    if "calibrate" in arguments and "--resume" not in arguments:
        out = dict(_values(arguments)).get("--out", "")
        begun = out != "" and os.path.exists(os.path.join(out, RUN_TOML))
        again += " --resume" if begun else ""
    if not begun:
        return f"interrupted before anything was kept; begin again with: {again}"
    return f"interrupted: what has finished is kept; go on with: {again}"


def say(line: str) -> None:
    """Print on stderr, in one line."""
    typer.echo(one_line(line), err=True)


class _ToStderr(logging.Handler):
    """Writes to what `sys.stderr` is at the time, which a test or a caller may have replaced."""

    def emit(self, record: logging.LogRecord) -> None:
        print(self.format(record), file=sys.stderr)


_TO_STDERR = _ToStderr()


def print_notices() -> None:
    """Print what the package logs; a second call changes nothing."""
    logger = logging.getLogger(PACKAGE)
    logger.addHandler(_TO_STDERR)
    logger.setLevel(logging.INFO)
