"""A RUN directory: inputs and settings, simulations, results.

Each command opens one `Run` and reads nothing else. run.toml holds the settings, the bank every
finished simulation. Each step's result is a tree that records what it was made from: it is current
while the run holds the same, and None otherwise.
"""

import fcntl
import json
import logging
import os
import sqlite3
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from functools import cached_property
from hashlib import sha256
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import tomli_w

from ..errors import Argument, InputError
from ..files import as_path, existing_file, write_text, write_whole
from ..inputs.cups import bundled_cups, kept_cups
from ..inputs.open import read_fields
from ..inputs.prior import read_prior
from ..inputs.recording import Recording, as_recording
from ..inputs.settings import CalibrationSettings, CriticismSettings, PourSettings
from ..simulators import own_versions
from ..wording import command
from .given_pours import GIVEN_POURS, digest_of_pours
from .results import SUMMARY_FILE, generations, read_result, write_result

if TYPE_CHECKING:
    from xarray import DataTree

    from ..inference import Prior, SimulationBank

logger = logging.getLogger(__name__)

LOCK = "run.lock"
RUN_TOML = "run.toml"
RECORDINGS = "recordings"
SIMULATIONS = "simulations.sqlite"
MOVING = "moving"
REPORT = "report.html"
RESULTS = {"calibrate": "posterior.nc", "criticise": "criticism.nc", "pour": "pour.nc"}
"""File of each step's result, in the order of the steps."""

OWN_FILES = (SIMULATIONS, *RESULTS.values(), GIVEN_POURS, RECORDINGS, MOVING, REPORT)
"""What only a run may hold."""

MUST_AGREE = ("settings", "inputs", "simulator", "engine")
"""Sections of run.toml that decide the results; dates, names and libraries may differ."""

SECTIONS = ("settings", "versions")
"""Of every run.toml, the last one included: a file that lacks one was cut off."""

ABSENT = {
    "calibrate": "the calibration in it is not finished",
    "criticise": "the calibration in it was not criticised",
    "pour": "no pour was chosen",
}


MAX_LETTERS = 60
"""Of a name, each of at most four bytes: a copy's name must fit into the 255 bytes of a file's."""


class HasRun(Protocol):
    """A result with a RUN directory: a calibration, a criticism or a pour."""

    @property
    def path(self) -> Path:
        """The RUN directory."""
        ...


RunOrPath = str | Path | HasRun
"""A RUN directory, or what was opened from one."""


def run_path(given: RunOrPath) -> Path:
    """The directory itself.

    Raises:
        InputError: It is neither a directory's path nor a result.
    """
    return as_path(getattr(given, "path", given), Argument("run"))


@contextmanager
def alone_in(directory: Path) -> Iterator[None]:
    """Keep other commands out of a directory, which is made if it is missing.

    The kernel releases the lock when the process ends; the empty file remains. It is not
    re-entrant. A directory that is read-only, or on a disk without locks, is not locked.

    Raises:
        InputError: Another command works there, or it is no directory.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as err:
        fix = "choose another directory"
        raise InputError("not a directory", where=str(directory), fix=fix) from err
    if not os.access(directory, os.W_OK):
        yield
        return
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW  # a link may lead to somebody else's file
    lock = os.open(directory / LOCK, flags, 0o666)
    try:
        with suppress(OSError):
            os.fchmod(lock, 0o666)  # others of the group may work here next, whatever the umask
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                "another command works in it",
                where=str(directory),
                fix="wait until it has ended, or choose another directory",
            ) from None
        except OSError:
            pass  # a disk without locks
        yield
    finally:
        os.close(lock)


@dataclass(frozen=True, eq=False)
class Run:
    """A run, whose results are looked for when they are asked for.

    Attributes:
        path: The RUN directory.
        record: run.toml, as it was when the run was opened.
    """

    path: Path
    record: Mapping[str, Any]

    @classmethod
    def open(cls, given: RunOrPath) -> "Run":
        """Read the settings of a run.

        Raises:
            InputError: There is none, it was cut off, or another version of fluid or engine made
                it.
        """
        run = cls(path := run_path(given), _read(path))
        run._check_generation()
        return run

    @classmethod
    @contextmanager
    def entered(cls, given: RunOrPath) -> "Iterator[Run]":
        """Lock a run and open it.

        Raises:
            InputError: There is none, or another command works in it.
        """
        _record_of(run_path(given))  # before a mistyped name becomes a directory
        with alone_in(run_path(given)):
            yield cls.open(given)

    @classmethod
    @contextmanager
    def begun(
        cls, path: Path, record: Mapping[str, Any], *, resume: bool, ends: tuple[str, ...] = ()
    ) -> "Iterator[Run]":
        """Lock a new run, or one with the same settings.

        run.toml is written before anything else, so that whatever is found later in the directory
        can be traced to its settings.

        Args:
            path: The directory; made if missing.
            record: Content of run.toml.
            resume: Whether the directory may hold a run, to go on with.
            ends: Fields of `record` that say nothing but when the work ends. They may change, and
                numbers among them grow. run.toml changes with the next result; until then the
                former ones are current.

        Raises:
            InputError: Another command works there; the directory holds a run and `resume` is
                false; or the run was made with another setting, seed or input.
        """
        record = tomllib.loads(tomli_w.dumps(record))  # as it will be read: TOML has no tuples
        with alone_in(path):
            if (path / RUN_TOML).exists():
                if not resume:
                    fix = "give `resume` to go on with it, or another `out`"
                    raise InputError("holds a run already", where=str(path), fix=fix)
                run = cls(path, cls.open(path)._continued(record, ends))
                run.write_summary()  # a killed command may not have come to it
                run.tell_missing_bank()
            else:
                _check_no_results(path)
                _write(path, record)
                run = cls(path, record)
            yield run

    def _continued(self, wanted: Mapping[str, Any], ends: tuple[str, ...]) -> Mapping[str, Any]:
        """The held record, or the wanted one with the held date where its ends are others."""
        differing = _differences(self.record, wanted)
        others = {field for field, pair in differing.items() if _goes_on(field, pair, ends)}
        differing = {field: pair for field, pair in differing.items() if field not in others}
        if differing:
            field, (held, asked) = next(iter(differing.items()))
            if field.startswith("inputs."):
                what = "is of other recordings"
                fix = f"give those that {RUN_TOML} names under files, unchanged, or another `out`"
                raise InputError(what, where=str(self.path), fix=fix)
            own = f"resume with the run's own value of `{field.rpartition('.')[2]}`"
            larger = " or a larger one" if field in ends else ""
            raise InputError(
                f"{field} is {held!r:.80} in the run, but {asked!r:.80} was asked",
                where=str(self.path / RUN_TOML),
                fix=f"{own}{larger}, or choose another `out`",
            )
        first = {"created": self.record["created"]} if "created" in self.record else {}
        return {**wanted, **first} if others else self.record

    @property
    def _copies(self) -> list[Path]:
        """Where the run keeps its recordings, so that it can be criticised wherever it was moved:
        numbered in their order, by the end of a long name."""
        names = enumerate(self.record.get("files", {}).get("recordings", ()), start=1)
        return [self.path / RECORDINGS / f"{at}-{name[-MAX_LETTERS:]}" for at, name in names]

    def keep_recordings(self, recordings: Sequence[Recording]) -> None:
        """Copy the files, byte for byte."""
        (self.path / RECORDINGS).mkdir(exist_ok=True)
        for copy, recording in zip(self._copies, recordings, strict=True):
            if not copy.exists() or sha256(copy.read_bytes()).hexdigest() != recording.hash:
                content = recording.path.read_bytes()
                write_whole(copy, lambda path, content=content: path.write_bytes(content))

    @cached_property
    def recordings(self) -> list[Recording]:
        """Those that were calibrated on, from the run's copies.

        Raises:
            InputError: A copy is missing, or is another recording.
        """
        opened, digests = [], self.record["inputs"]["sha256"]
        for path, digest in zip(self._copies, digests, strict=True):
            content = existing_file(path).read_bytes()
            if sha256(content).hexdigest() != digest:
                raise InputError(
                    "is not the recording that this run was calibrated on",
                    where=str(path),
                    fix="put the original back, or calibrate again",
                )
            # with these bytes it has been checked
            opened.append(as_recording(read_fields(content, path), path, content))
        return opened

    @cached_property
    def prior(self) -> "Prior":
        """Prior of the parameters."""
        return read_prior(self.record["settings"]["prior"])

    @cached_property
    def settings(self) -> CalibrationSettings:
        """Settings of the calibration, beside its prior."""
        held = self.record["settings"].items()
        return CalibrationSettings(**{name: of for name, of in held if name != "prior"})

    def tell_missing_bank(self) -> None:
        """Log that the simulations of a finished calibration were removed, if they were."""
        path = self.path / SIMULATIONS
        if not path.exists() and (self.path / RESULTS["calibrate"]).exists():
            logger.warning("%s is missing: what needs its simulations makes them again", path)

    @contextmanager
    def bank(self) -> "Iterator[SimulationBank]":
        """Every finished simulation.

        Raises:
            InputError: The file is damaged or cannot be written.
            OSError: The disk is full or fails.
        """
        from ..inference import SimulationBank

        path = self.path / SIMULATIONS
        self.tell_missing_bank()
        try:
            bank = SimulationBank(path)
        except (ValueError, sqlite3.Error) as err:
            raise _unusable(path, err) from err
        with bank:
            try:
                yield bank
            except sqlite3.Error as err:
                raise _unusable(path, err) from err

    def result(self, step: str) -> "DataTree | None":
        """A step's result if it is current, else None."""
        return self._look(step)[0]

    def why_not(self, step: str) -> str:
        """Why an existing result is not current, else an empty string."""
        there = (self.path / RESULTS[step]).is_file()
        return self._look(step)[1] if there else ""

    def required(self, step: str) -> "DataTree":
        """Result of a step, which must be current.

        Raises:
            InputError: There is none; the message says why, and which command makes it.
        """
        tree, why = self._look(step)
        if tree is None:
            for earlier in list(RESULTS)[: list(RESULTS).index(step)]:
                if earlier == "calibrate" or self.why_not(earlier):  # a criticism is not needed
                    self.required(earlier)
            raise InputError(why, where=str(self.path), fix=f"run: {self.again(step)}")
        return tree

    def keep(
        self, step: str, tree: "DataTree", made_from: Mapping[str, Any], summary: Mapping[str, Any]
    ) -> None:
        """Write a result, and summary.json.

        Args:
            step: Of `RESULTS`.
            tree: What it has concluded; gets the attributes `made_from` and `summary`.
            made_from: Inputs and settings that decide it, as JSON takes them.
            summary: Its section of summary.json.
        """
        tree.attrs |= {"made_from": as_json(made_from), "summary": json.dumps(summary)}
        if step == "calibrate":  # of a run that may have grown
            _write(self.path, self.record)
        write_result(tree, self.path / RESULTS[step])
        self.write_summary()

    def write_summary(self) -> None:
        """Write summary.json from the current results: it is for people and other programs."""
        trees = [(step, self.result(step)) for step in RESULTS]
        found = {
            step: json.loads(tree.attrs["summary"]) for step, tree in trees if tree is not None
        }
        if found:  # else numbers of a run that is growing stay until it has others
            text = json.dumps(found, indent=2, allow_nan=False)
            write_text(self.path / SUMMARY_FILE, f"{text}\n")

    @property
    def made_from(self) -> dict[str, Any]:
        """Settings, inputs and versions that decide the calibration."""
        return {name: self.record.get(name) for name in (*MUST_AGREE, "files")}

    def posterior_key(self) -> str:
        """Key of the latest posterior: the criticism's where it has added an effect."""
        criticism = self.result("criticise")
        if criticism is not None and json.loads(criticism.attrs["summary"])["accepted"]:
            return key_of(criticism)
        return key_of(self.required("calibrate"))

    def own_effects(self) -> list[str]:
        """Versions of one's own effects that the current criticism has accepted."""
        criticism = self.result("criticise")
        accepted = () if criticism is None else json.loads(criticism.attrs["summary"])["accepted"]
        return own_versions(accepted)

    def again(self, step: str) -> str:
        """The command that makes a step's result, with the options of one that is readable."""
        if step == "calibrate":
            clean = (
                ["--baseline", "CLEAN..."] if "baseline" in self.record.get("inputs", {}) else []
            )
            pour = self.record.get("simulator", {}).get("pour")
            cups = ["--cups", "CUPS"] if pour and kept_cups(pour) != bundled_cups() else []
            return self._calibrate_again(*clean, *cups, "--out", self.path, "--resume")
        try:
            made = json.loads(read_result(self.path / RESULTS[step]).attrs["made_from"])
        except (OSError, ValueError):
            return command(step, self.path)
        usual = CriticismSettings() if step == "criticise" else PourSettings()
        given = ("held_out", "baseline", "pours")
        files = {name: list(made.get(name, {}).values()) for name in given}
        options = _options(
            {**made.get("settings", {}), **files}, {**asdict(usual), **dict.fromkeys(files)}
        )
        forced = ["--force"] if made.get("forced") else []
        return command(step, self.path, *options, *forced)

    def _calibrate_again(self, *words: object) -> str:
        """The command that calibrates on the kept recordings, with the settings of the run."""
        copies = [path for path in self._copies if path.is_file()]
        options = _options(self.record.get("settings", {}), asdict(CalibrationSettings()))
        return command("calibrate", *(copies or ["RECORDING..."]), *words, *options)

    def _look(self, step: str) -> "tuple[DataTree | None, str]":
        """A step's current result, or why there is none."""
        path = self.path / RESULTS[step]
        if not path.is_file():
            return None, ABSENT[step]
        try:
            tree = read_result(path)
        except (OSError, ValueError):
            lost = "" if step == "calibrate" else ", and the options that it was made with are lost"
            return None, f"{path.name} is damaged{lost}"
        accepted = json.loads(tree.attrs["summary"]).get("accepted", ())
        why = self._stale(step, json.loads(tree.attrs["made_from"]), accepted)
        return (None, f"{path.name} {why}") if why else (tree, "")

    def _stale(self, step: str, made_from: Mapping[str, Any], accepted: Sequence[str]) -> str:
        """The first difference of a result from the run; "" where it is current.

        Args:
            step: Of `RESULTS`.
            made_from: See `keep`.
            accepted: Effects that the result adds to the model.
        """
        if step == "calibrate":
            same = as_json(made_from) == as_json(self.made_from)
            return "" if same else f"was made by other settings than {RUN_TOML} holds"
        calibration, why = self._look("calibrate")
        if calibration is None:
            return f"cannot be used: {why}"
        if step == "pour" and (why := self.why_not("criticise")):
            return f"cannot be used: {why}"
        after = key_of(calibration) if step == "criticise" else self.posterior_key()
        if made_from["after"] != after:
            return "was made from another posterior"
        if step == "pour" and made_from["given"] != (given := digest_of_pours(self.path)):
            which = "other given pours" if given else "given pours that are missing"
            return f"was made with {which}"
        if step == "pour":
            effects, made_with = self.own_effects(), made_from.get("effects", ())
        else:
            effects, made_with = own_versions(accepted), chain(*made_from.get("considered", ()))
        for version in sorted({*effects} - {*made_with}):
            return f"was made with other files of the effect {version.split()[0]}"
        return ""

    def _check_generation(self) -> None:
        """Refuse a run of another version of fluid or engine."""
        now, simulators = generations(), self.record.get("simulator", {}).values()
        made_by = [("model", one["model"]) for one in simulators if "model" in one]
        if engine := self.record.get("engine", {}).get("version"):
            made_by.append(("engine", engine))
        for part, version in made_by:
            if version != now[part]:
                anew = _beside(self.path, f"{part}_{now[part]}")
                again = f"calibrate again: {self._calibrate_again('--out', anew)}"
                raise InputError(
                    f"was made by {part} {version}, and this is {now[part]}",
                    where=str(self.path),
                    fix=again if "files" in self.record else "choose another `out`",  # a check's
                )


def _options(settings: Mapping[str, Any], usual: Mapping[str, Any]) -> list[str]:
    """Options of a command, where they are not the usual ones; a list repeats its option."""
    return [
        word
        for name, value in settings.items()
        if name in usual and value != usual[name]
        for one in (value if isinstance(value, list) else [value])
        for word in (f"--{name.replace('_', '-')}", str(one))
    ]


def as_json(made_from: Mapping[str, Any]) -> str:
    """One text for equal content."""
    return json.dumps(made_from, sort_keys=True)


def key_of(tree: "DataTree") -> str:
    """Digest of a posterior's draws."""
    draws, digest = tree["posterior"].to_dataset(), sha256()
    for name in sorted(map(str, draws.data_vars)):
        digest.update(name.encode() + draws[name].to_numpy().tobytes())
    return digest.hexdigest()


def check_resumable(path: Path) -> None:
    """Refuse to go on where nothing has begun, as with a mistyped name.

    Raises:
        InputError: There is no run; the message names one that may have been meant.
    """
    if (path / RUN_TOML).exists():
        return
    near = _run_near(path)
    fix = f"did you mean {near}? To begin" if near else "to begin"
    raise InputError(
        "holds no run to resume",
        where=str(path),
        fix=_way_out(path) or f"{fix} a new run, leave --resume out",
    )


def _run_near(path: Path) -> Path | None:
    """A run that may have been meant: within the directory, around it, or of a name like it."""
    around = (*sorted(path.glob(f"*/{RUN_TOML}")), path.parent / RUN_TOML)
    if found := [one.parent for one in around if one.exists()]:
        return found[0]
    beside = {one.parent.name: one.parent for one in path.parent.glob(f"*/{RUN_TOML}")}
    return next((beside[name] for name in get_close_matches(path.name, beside, n=1)), None)


def _record_of(path: Path) -> Path:
    """The file of a run's settings."""
    if not (path / RUN_TOML).is_file():
        usual = "give the directory of a run, as made by: bolfi-liquids calibrate ... --out RUN"
        raise InputError(f"no {RUN_TOML} in it", where=str(path), fix=_way_out(path) or usual)
    return path / RUN_TOML


def _read(path: Path) -> dict[str, Any]:
    """run.toml."""
    file, record = _record_of(path), {}
    try:
        record = tomllib.loads(file.read_text(encoding="utf-8"))
        missing = [name for name in SECTIONS if not record.get(name)]
        fault = f"is cut off: it has no {missing[0]}" if missing else ""
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as err:
        fault = f"not TOML ({err})"
    if fault:
        fix = ", or ".join(["restore the file", *filter(None, [_way_out(path)])])
        raise InputError(fault, where=str(file), fix=fix)
    return record


def _way_out(path: Path) -> str:
    """Cure where run.toml is lost, but not the recordings; "" where they are lost, too."""
    if not (copies := sorted((path / RECORDINGS).glob("*.nc"))):
        return ""
    anew = command("calibrate", *copies, "--out", _beside(path, "anew"))
    return f"calibrate its recordings anew: {anew}"


def _beside(path: Path, ending: str) -> Path:
    """A directory beside a run's, of a name that begins with the run's."""
    whole = path if path.name else path.absolute()  # "." has no name
    return whole.with_name(f"{whole.name}_{ending}")


def _check_no_results(path: Path) -> None:
    """Raise `InputError` where results lie without the settings that made them."""
    for name in OWN_FILES:
        if (path / name).exists():
            raise InputError(
                f"holds {name} without {RUN_TOML}",
                where=str(path),
                fix=_way_out(path) or "choose another `out`; nothing was overwritten",
            )


def _write(path: Path, record: Mapping[str, Any]) -> None:
    write_text(path / RUN_TOML, tomli_w.dumps(record))


def _goes_on(field: str, values: tuple[Any, Any], ends: tuple[str, ...]) -> bool:
    """Whether a field that has another value lets a run go on: one of `ends`, and no smaller."""
    held, asked = values
    smaller = isinstance(held, int) and isinstance(asked, int) and asked < held
    return field.startswith(ends) and not smaller


def _differences(held: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Fields that decide the results -> their values in both records, where these differ."""
    old, new = (
        dict(_fields({k: one[k] for k in MUST_AGREE if k in one})) for one in (held, wanted)
    )
    both = {field: (old.get(field), new.get(field)) for field in {**new, **old}}
    return {field: values for field, values in both.items() if values[0] != values[1]}


def _fields(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        name = f"{path}.{key}" if path else str(key)
        if isinstance(value, Mapping):
            yield from _fields(value, name)
        else:
            yield name, value


def _unusable(path: Path, err: Exception) -> InputError:
    # the bank's own error names the path and another cure
    cause = err.__cause__ if isinstance(err.__cause__, sqlite3.Error) else err
    another = "restore it from a copy, or start again with another --out"
    writable = isinstance(cause, sqlite3.OperationalError)
    fix = f"make it writable, {another}" if writable else another
    return InputError(f"cannot be used ({cause})", where=str(path), fix=fix)
