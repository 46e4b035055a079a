"""Programs with a command line and files, as simulators."""

import os
import shlex
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from string import Formatter
from tempfile import TemporaryDirectory
from typing import Any, cast

import numpy as np

from ..arguments import check_callable, check_kind, check_text, require
from ..describe import describe
from .job import OneByOne

FILES = frozenset({"in", "out"})
TAIL = 5  # lines of stderr that an error holds
TAIL_LETTERS = 1000
GUARD = "/bin/sh", "-c", "read _; kill -9 0"  # 0 is its own group

_ends: ContextVar[float | None] = ContextVar("ends", default=None)  # of time.monotonic

Write = Callable[[Path, dict[str, float], int], object]
Read = Callable[[Path], Any]


class RunFailed(RuntimeError):
    """A run of a program gave no signal."""


class Program(OneByOne):
    """A simulator that is a program: `fit(Program("./model {in} {out}"), prior, observed)`.

    Each run has an empty directory of its own, in which it starts, and which is removed when it
    has ended. A run fails if it ends with another exit code than 0, or if its output is missing
    or cannot be read; the error holds the last lines of its stderr. With `fit(timeout=)` a run
    that is overdue is killed, with all processes of its group, and so it is where the process that
    waits for it is killed. Runs share nothing, so that threads suffice to make several at a time:
    `fit(..., executor=ThreadPoolExecutor(4))`.

    Args:
        command: Its words are split as a shell does, without a shell. In braces, with a format if
            need be: parameters such as {a} or {a:.3f}, {seed}, {in} and {out}, the files of input
            and output. Words that begin with ./ or ../ are paths from the current directory of
            whoever makes the Program; other relative paths are in the run's.
        write: The text of {in}, with parameters and {seed} in braces (a brace itself is doubled);
            or a function (directory, theta: name -> float, seed) that writes any files. None
            writes `name = value` lines, of all parameters and the seed, where the command has {in}.
        read: A function (directory) -> signal. None is `numpy.loadtxt` of `out`, where the command
            has {out}, and of `stdout`, in which the directory holds what the program prints.
        keep: Folder that gets the directories of failed runs; None removes them, too.

    Raises:
        ValueError: bad argument, or braces that do not match; before the first run, where this
            computer makes it, no such program.
    """

    def __init__(
        self,
        command: str,
        *,
        write: str | Write | None = None,
        read: Read | None = None,
        keep: str | os.PathLike[str] | None = None,
    ):
        check_text("command", command)
        words, named = _parsed("command", command, shlex.split)
        require(words, "command", "have words", command)
        if isinstance(write, str):
            named |= _parsed("write", write, lambda text: [text])[1]
            due = "have the word {in}, the file of the text that write gives"
            require("in" in named, "command", due, command)
        else:
            check_callable("write, if no text,", write)
        check_callable("read", read)
        check_kind("keep", keep, str | os.PathLike | None)
        folder = None if keep is None else Path(keep).absolute()
        here = tuple(map(_from_here, words))
        run = _Run(here, tuple(sorted(named)), write, read, folder)
        super().__init__(run, _limited, describe(run))

    def _check_here(self) -> None:
        """Raise ValueError unless the program is found, where its name is the same in all runs and
        no path in their directories."""
        first = cast(_Run, self.simulate).words[0]
        name = "" if _parsed("command", first, lambda word: [word])[1] else first.format()
        elsewhere = not name or ("/" in name and not os.path.isabs(name))
        due = "begin with a program that this computer has and may execute"
        require(elsewhere or shutil.which(name), "command", due, name, cure="correct its path")


def check_names(simulator: object, parameters: Collection[str]) -> None:
    """Raise ValueError for a `Program` that cannot be run with parameters of these names."""
    run = simulator.simulate if isinstance(simulator, Program) else None
    if isinstance(run, _Run):
        run.check(parameters)


@dataclass(frozen=True)
class _Run:
    """One run of a program; see `Program`.

    Attributes:
        words: Of the command.
        named: What words and template have in braces.
    """

    words: tuple[str, ...]
    named: tuple[str, ...]
    write: str | Write | None
    read: Read | None
    keep: Path | None = field(compare=False)

    def __call__(self, theta: dict[str, float], seed: int) -> Any:
        """Raises RunFailed, or TimeoutError where it was overdue."""
        with TemporaryDirectory(prefix="program-", ignore_cleanup_errors=True) as made:
            directory = Path(made)
            try:
                return self._simulate(directory, theta, seed)
            except BaseException as error:
                told = _explained(error, directory, self.keep)
                if isinstance(error, Exception) and not isinstance(error, TimeoutError):
                    raise RunFailed(told) from error
                raise

    def _simulate(self, directory: Path, theta: dict[str, float], seed: int) -> Any:
        known = {**theta, "seed": seed, **{name: str(directory / name) for name in FILES}}
        self.check(theta)
        if isinstance(self.write, str):
            (directory / "in").write_text(self.write.format_map(known), encoding="utf-8")
        elif self.write is not None:
            self.write(directory, dict(theta), seed)
        elif "in" in self.named:
            lines = [f"{name} = {value}\n" for name, value in (theta | {"seed": seed}).items()]
            (directory / "in").write_text("".join(lines), encoding="utf-8")
        _execute([word.format_map(known) for word in self.words], directory)
        if self.read is not None:
            return self.read(directory)
        return _numbers(directory / ("out" if "out" in self.named else "stdout"))

    def check(self, parameters: Collection[str]) -> None:
        """Raise ValueError for a name or a format in braces that is none, and for a parameter
        without use."""
        due = f"not be named {sorted(FILES)}"
        require(not FILES & set(parameters), "parameters", due, [*parameters])
        known = {*parameters, "seed", *FILES}
        unknown = sorted(set(self.named) - known)
        require(not unknown, "names in braces", f"be among {sorted(known)}", unknown)
        told = callable(self.write) or (self.write is None and "in" in self.named)
        unused = sorted(set(parameters) - set(self.named))
        due = "all be in braces in the command or its input"
        require(told or not unused, "parameters", due, unused)
        numbers = {**dict.fromkeys(parameters, 0.5), "seed": 1, **dict.fromkeys(FILES, "")}
        for text in (*self.words, self.write if isinstance(self.write, str) else ""):
            try:
                text.format_map(numbers)
            except ValueError as error:
                raise ValueError(
                    f"formats in braces must be those of numbers, such as {{a:.3f}}, got {text!r} "
                    f"({error})"
                ) from error


def _execute(words: Sequence[str], directory: Path) -> None:
    """Run a command in a directory; it ends with its whole group of processes when time is up, and
    when this process ends, however it does: then the guard's input ends.

    Raises:
        OSError: there is no such program.
        RunFailed: another exit code than 0.
        TimeoutError: it took longer than `_limited` allows.
    """
    ends = _ends.get()
    with (
        subprocess.Popen(GUARD, stdin=subprocess.PIPE, process_group=0) as guard,
        open(directory / "stdout", "wb") as out,
        open(directory / "stderr", "wb") as err,
    ):
        program = subprocess.Popen(
            words,
            cwd=directory,
            stdin=subprocess.DEVNULL,
            stdout=out,  # a file, for a pipe that a grandchild inherits never ends
            stderr=err,
            process_group=guard.pid,
        )
        try:
            code = program.wait(None if ends is None else max(ends - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired as error:
            raise TimeoutError("overdue") from error
        finally:  # what the program left running, too, and if a person interrupts
            os.killpg(guard.pid, signal.SIGKILL)
            program.wait()
    if code:
        how = f"exit code {code}" if code > 0 else f"signal {signal.Signals(-code).name}"
        raise RunFailed(f"{words[0]} ended with {how}")


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Within it programs of this thread are killed once so many seconds are over."""
    token = _ends.set(time.monotonic() + seconds)
    try:
        yield
    finally:
        _ends.reset(token)


def _numbers(path: Path) -> np.ndarray:
    require(path.exists() and path.stat().st_size, f"`{path.name}`", "hold numbers", "nothing")
    return np.loadtxt(path, ndmin=1)


def _explained(error: BaseException, directory: Path, keep: Path | None) -> str:
    """What happened, the end of stderr, and where the files of the run are kept."""
    path = directory / "stderr"
    said = path.read_bytes().decode(errors="replace") if path.exists() else ""
    tail = "\n".join(said.strip().splitlines()[-TAIL:])[-TAIL_LETTERS:]
    what = f"{error}" if isinstance(error, RunFailed) else f"{type(error).__name__}: {error}"
    return f"{what}{_kept(directory, keep)}{tail and f'; stderr ends:\n{tail}'}"


def _kept(directory: Path, keep: Path | None) -> str:
    """Copy the files of a run that failed; returns where they are, for a message."""
    if keep is None:
        return ""
    try:
        copied = shutil.copytree(directory, keep / directory.name, symlinks=True)
    except OSError as error:  # a pipe is among them, or the disk is full: not why the run failed
        return f"; not all of its files could be kept in {keep} ({error})"
    return f"; its files are in {copied}"


def _from_here(word: str) -> str:
    """A word that begins with ./ or ../ as an absolute path."""
    if not word.startswith(("./", "../")):
        return word
    here = str(Path.cwd()).replace("{", "{{").replace("}", "}}")
    return os.path.normpath(os.path.join(here, word))


def _parsed(
    argument: str, text: str, split: Callable[[str], list[str]]
) -> tuple[list[str], frozenset[str]]:
    """Words of a text, and what they have in braces."""
    try:
        words = split(text)
        parts = [part for word in words for part in Formatter().parse(word)]
    except ValueError as error:
        raise ValueError(f"{argument} cannot be read ({error}), got {text!r}") from error
    named = frozenset(name for _, name, _, _ in parts if name is not None)
    plain = all(name.isidentifier() for name in named)
    plain = plain and not any("{" in (form or "") for _, _, form, _ in parts)
    require(plain, argument, "have names in braces, such as {a} or {a:.3f}", text)
    return words, named
