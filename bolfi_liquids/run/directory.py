"""The RUN directory: what it holds, and when a command may go on in it."""

import sqlite3
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import tomli_w

from ..errors import Argument, InputError
from ..files import as_path, write_new_text, write_text
from .formats import upgraded
from .summary import SUMMARY_FILE as SUMMARY

if TYPE_CHECKING:
    from ..inference import SimulationBank

PROGRAM = "bolfi-liquids"
RUN_TOML = "run.toml"
SIMULATIONS = "simulations.sqlite"
POSTERIOR = "posterior.nc"
CRITICISM = "criticism.nc"
CRITICISM_FORMAT = 3  # of what a criticism is kept as; another is made again
POUR = "pour.nc"
GIVEN_POURS = "given_pours.nc"
FRAMES = "frames.nc"
REPORT = "report.html"


class HasRun(Protocol):
    """A result that knows its RUN directory: a calibration, a criticism or a pour."""

    @property
    def path(self) -> Path:
        """The RUN directory."""
        ...


Run = str | Path | HasRun
"""A RUN directory, or what was opened from one."""


def run_path(run: Run) -> Path:
    """The directory itself.

    Raises:
        InputError: It is neither a directory's path nor a result.
    """
    return as_path(getattr(run, "path", run), Argument("run"))


MUST_AGREE = ("settings", "inputs", "simulator", "engine")
"""Sections of run.toml that decide the results; versions and dates may differ."""

TIMEOUTS = "timeouts"  # key of run.toml

CONCLUSIONS = (POSTERIOR, CRITICISM, POUR, FRAMES, REPORT, SUMMARY)
"""What follows from the simulations, in the order in which it goes when these become more."""


def enter_run(
    run: Path, record: Mapping[str, Any], *, resume: bool, growing: str = ""
) -> list[str]:
    """Start a run, or go on with one of the same settings.

    `record` is written to run.toml before anything else, so that whatever is found later in
    the directory can be traced to its settings.

    Args:
        run: The directory.
        record: Of the run, in the sections that `MUST_AGREE` names and others.
        resume: Whether the directory may hold a run, to go on with.
        growing: Field of `record`, if any, that may be larger than in the run that is gone on
            with. All simulations are kept then; what was concluded from fewer is removed.
            run.toml says in `grown` when, by which versions, and what there was before.

    Returns:
        Names of the conclusions that were removed.

    Raises:
        InputError: The directory holds a run and `resume` is false, or the run in it was made
            with another setting, seed or input; nothing is written then.
    """
    path = run / RUN_TOML
    if run.exists() and not run.is_dir():
        raise InputError("not a directory", where=str(run), fix="choose another `out`")
    if path.exists():
        if not resume:
            raise held_error(run)
        held = read_run(run)
        differing = _differences(held, record)
        grows = growing in differing and _larger(*differing[growing])
        others = {field: both for field, both in differing.items() if field != growing or not grows}
        if others:
            raise _refused(others, held, run, growing)
        return _grow(run, held, record, differing[growing][0]) if grows else []
    orphans = [name for name in (SIMULATIONS, *CONCLUSIONS) if (run / name).exists()]
    if orphans:
        raise InputError(
            f"holds {orphans[0]} without {RUN_TOML}",
            where=str(run),
            fix="choose another `out`; nothing was overwritten",
        )
    run.mkdir(parents=True, exist_ok=True)
    try:
        write_new_text(path, tomli_w.dumps(record))
    except FileExistsError:  # another call has begun here meanwhile
        raise held_error(run) from None
    return []


def held_error(run: Path) -> InputError:
    """A refusal to begin where a run is."""
    return InputError(
        "holds a run already",
        where=str(run),
        fix="give `resume` to go on with it, or another `out`",
    )


def check_resumable(run: Path) -> None:
    """Refuse to go on where nothing has begun, as with a mistyped name.

    Raises:
        InputError: There is no run; the message names one that may have been meant.
    """
    if (run / RUN_TOML).exists():
        return
    near = _run_near(run)
    fix = f"did you mean {near}? To begin" if near else "to begin"
    raise InputError(
        "holds no run to resume", where=str(run), fix=f"{fix} a new run, leave --resume out"
    )


def _run_near(run: Path) -> Path | None:
    """A run that may have been meant: within the directory, around it, or of a name like it."""
    around = (*sorted(run.glob(f"*/{RUN_TOML}")), run.parent / RUN_TOML)
    if found := [path.parent for path in around if path.exists()]:
        return found[0]
    beside = {path.parent.name: path.parent for path in run.parent.glob(f"*/{RUN_TOML}")}
    return next((beside[name] for name in get_close_matches(run.name, beside, n=1)), None)


def note_timeout(run: Path, timeout: float | None) -> dict[str, Any]:
    """Add a time limit [s] to those that run.toml lists; None adds nothing.

    Runs may go on with another limit, but it decides which simulations were given up.

    Returns:
        run.toml.
    """
    record = read_run(run)
    listed = record.get(TIMEOUTS, [])
    if timeout is not None and timeout not in listed:
        record = {**record, TIMEOUTS: [*listed, float(timeout)]}
        write_text(run / RUN_TOML, tomli_w.dumps(record))
    return record


@contextmanager
def open_bank(run: Path) -> "Iterator[SimulationBank]":
    """The run's finished simulations.

    Raises:
        InputError: The file is damaged or cannot be written.
        OSError: The disk is full or fails.
    """
    from ..inference import SimulationBank

    path = run / SIMULATIONS
    try:
        bank = SimulationBank(path)
    except (ValueError, sqlite3.Error) as err:
        raise _unusable(path, err) from err
    with bank:
        try:
            yield bank
        except sqlite3.Error as err:
            raise _unusable(path, err) from err


def _unusable(path: Path, err: Exception) -> InputError:
    # the bank's own error names the path and another cure
    cause = err.__cause__ if isinstance(err.__cause__, sqlite3.Error) else err
    return InputError(
        f"cannot be used ({cause})",
        where=str(path),
        fix="make it writable, restore it from a copy, or start again with another --out",
    )


def read_run(run: Path) -> dict[str, Any]:
    """The run's settings, as written when it started, in this version's form.

    Raises:
        InputError: There is no run.toml, or it is not TOML.
    """
    path = run / RUN_TOML
    if not path.is_file():
        raise InputError(
            f"no {RUN_TOML} in it",
            where=str(run),
            fix="give the directory of a run, as made by: bolfi-liquids calibrate ... --out RUN",
        )
    try:
        return upgraded(tomllib.loads(path.read_text(encoding="utf-8")))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as err:
        raise InputError(f"not TOML ({err})", where=str(path), fix="restore the file") from err


def _differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Fields that decide the results -> their values in both records, where these differ."""
    # through TOML, so that a tuple compares as what was written
    wanted = dict(_fields({k: tomllib.loads(tomli_w.dumps(new)).get(k) for k in MUST_AGREE}))
    held = dict(_fields({k: old.get(k) for k in MUST_AGREE}))
    fields = [*wanted, *(held.keys() - wanted.keys())]
    both = {field: (held.get(field), wanted.get(field)) for field in fields}
    return {field: values for field, values in both.items() if values[0] != values[1]}


def _refused(
    differing: Mapping[str, tuple[Any, Any]], record: Mapping[str, Any], run: Path, growing: str
) -> InputError:
    """A refusal that names the first field that differs from the run's `record`."""
    field, (held, wanted) = next(iter(differing.items()))
    if field.startswith("inputs."):
        what = "is of other recordings"
        fix = f"give those that {RUN_TOML} names under files, unchanged, or choose another `out`"
        return InputError(what, where=str(run), fix=fix)
    if field.startswith(("engine.", "simulator.")):  # settings and recordings are the same
        made_by = record.get("versions", {}).get(PROGRAM)
        what = f"{field} was {held!r} and is {wanted!r} now"
        fix = "begin again with another `out`"
        if made_by not in (None, version(PROGRAM)):
            fix += f", or go on with version {made_by}, which made the run"
    else:
        what = f"{field} is {held!r} in the run, but {wanted!r} was asked"
        own = "the run's own value" + (" or a larger one" if field == growing else "")
        fix = f"resume with {own}, or choose another `out`"
    return InputError(what, where=f"{run / RUN_TOML}", fix=fix)


def _larger(held: Any, wanted: Any) -> bool:
    return isinstance(held, int) and isinstance(wanted, int) and wanted > held


def _grow(run: Path, held: Mapping[str, Any], record: Mapping[str, Any], size: int) -> list[str]:
    """Make room for a larger run: `record` in the place of `held`, of which `size` grows."""
    grown = held.get("grown", [])
    with open_bank(run) as bank:
        simulations = len(bank)
    before = grown[-1] if grown else {"learned_from": 0, "simulations": 0}
    learned_from = min(size, before["learned_from"] + simulations - before["simulations"])
    now = {"size": size, "learned_from": learned_from, "simulations": simulations}
    made = {key: record[key] for key in ("created", "versions") if key in record}
    # first what was concluded: a call that is killed here leaves an unfinished run
    removed = [name for name in CONCLUSIONS if (run / name).exists()]
    for name in removed:
        (run / name).unlink(missing_ok=True)
    first = {key: held[key] for key in (*made, TIMEOUTS) if key in held}
    write_text(run / RUN_TOML, tomli_w.dumps({**record, **first, "grown": [*grown, now | made]}))
    return removed


def _fields(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        name = f"{path}.{key}" if path else str(key)
        if isinstance(value, Mapping):
            yield from _fields(value, name)
        else:
            yield name, value
