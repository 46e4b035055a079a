"""A RUN directory: inputs and settings, simulations, results.

Each command opens one `Run` and reads nothing else. run.toml holds the settings, the bank every
finished simulation. Each step's result is a tree that records what it was made from: it is current
while the run holds the same, and None otherwise.
"""

import json
import logging
import sqlite3
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import tomli_w

from ..errors import Argument, InputError
from ..files import as_path, write_text
from ..inputs.prior import read_prior
from ..inputs.recording import Recording
from ..inputs.settings import CalibrationSettings, CriticismSettings, PourSettings
from ..wording import command
from .given_pours import GIVEN_POURS, digest_of_pours
from .lock import alone_in
from .provenance import generations
from .recordings import RECORDINGS_FOLDER, kept_paths, kept_recordings
from .result_file import read_result, write_result
from .summary import SUMMARY_FILE, write_summary

if TYPE_CHECKING:
    from xarray import DataTree

    from ..inference import Prior, SimulationBank

logger = logging.getLogger(__name__)

RUN_TOML = "run.toml"
SIMULATIONS = "simulations.sqlite"
MOVING = "moving"
REPORT = "report.html"
RESULTS = {
    "calibrate": "posterior.nc",
    "criticise": "criticism.nc",
    "pour": "pour.nc",
}
"""File of each step's result, in the order of the steps."""

OWN_FILES = (SIMULATIONS, *RESULTS.values(), GIVEN_POURS, RECORDINGS_FOLDER, MOVING, REPORT)
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
        if missing := [name for name in SECTIONS if not run.record.get(name)]:
            what = f"is cut off: it has no {missing[0]}"
            raise InputError(what, where=str(path / RUN_TOML), fix="restore the file")
        run._check_generation()
        return run

    @classmethod
    @contextmanager
    def entered(cls, given: RunOrPath) -> "Iterator[Run]":
        """Lock a run and open it.

        Raises:
            InputError: There is none, or another command works in it.
        """
        _read(run_path(given))  # before a mistyped name becomes a directory
        with alone_in(run_path(given)):
            yield cls.open(given)

    @classmethod
    @contextmanager
    def begun(
        cls, path: Path, record: Mapping[str, Any], *, resume: bool, growing: str = ""
    ) -> "Iterator[Run]":
        """Lock a new run, or one with the same settings.

        run.toml is written before anything else, so that whatever is found later in the directory
        can be traced to its settings.

        Args:
            path: The directory; made if missing.
            record: Content of run.toml.
            resume: Whether the directory may hold a run, to go on with.
            growing: Field of `record`, if any, that may exceed the held value. run.toml changes
                with the next result; until then the former ones are current.

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
                run = cls(path, cls.open(path)._continued(record, growing))
                run.write_summary()  # a killed command may not have come to it
            else:
                _check_no_results(path)
                _write(path, record)
                run = cls(path, record)
            yield run

    def _continued(self, wanted: Mapping[str, Any], growing: str) -> Mapping[str, Any]:
        """The held record, or the wanted one with the held date where the run grows.

        Raises:
            InputError: They differ otherwise; the message names the first field.
        """
        differing = _differences(self.record, wanted)
        held, asked = differing.get(growing, (None, None))
        if grows := isinstance(held, int) and isinstance(asked, int) and asked > held:
            del differing[growing]
        if differing:
            field, (held, asked) = next(iter(differing.items()))
            if field.startswith("inputs."):
                what = "is of other recordings"
                fix = f"give those that {RUN_TOML} names under files, unchanged, or another `out`"
                raise InputError(what, where=str(self.path), fix=fix)
            own = f"resume with the run's own value of `{field.rpartition('.')[2]}`"
            larger = " or a larger one" if field == growing else ""
            raise InputError(
                f"{field} is {held!r} in the run, but {asked!r} was asked",
                where=str(self.path / RUN_TOML),
                fix=f"{own}{larger}, or choose another `out`",
            )
        first = {"created": self.record["created"]} if "created" in self.record else {}
        return {**wanted, **first} if grows else self.record

    @cached_property
    def recordings(self) -> list[Recording]:
        """Copies of the calibrated recordings.

        Raises:
            InputError: A copy is missing, or is another recording.
        """
        return kept_recordings(self.path, self.record)

    @cached_property
    def prior(self) -> "Prior":
        """Of the parameters, before stirring."""
        return read_prior(self.record["settings"]["prior"])

    @contextmanager
    def bank(self) -> "Iterator[SimulationBank]":
        """Every finished simulation.

        Raises:
            InputError: The file is damaged or cannot be written.
            OSError: The disk is full or fails.
        """
        from ..inference import SimulationBank

        path = self.path / SIMULATIONS
        if not path.exists() and (self.path / RESULTS["calibrate"]).exists():
            logger.warning("%s is missing: its simulations are made again", path)
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
        """The same as `result`.

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
        self,
        step: str,
        tree: "DataTree",
        made_from: Mapping[str, Any],
        summary: Mapping[str, Any],
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
            write_summary(self.path / SUMMARY_FILE, found)

    @property
    def made_from(self) -> dict[str, Any]:
        """What decides the calibration."""
        return {name: self.record.get(name) for name in (*MUST_AGREE, "files")}

    def posterior_key(self) -> str:
        """Key of the latest posterior: the criticism's where it has added an effect."""
        criticism = self.result("criticise")
        if criticism is not None and json.loads(criticism.attrs["summary"])["accepted"]:
            return key_of(criticism)
        return key_of(self.required("calibrate"))

    def again(self, step: str) -> str:
        """The command that makes a step's result, with the options of one that is readable."""
        if step == "calibrate":
            clean = (
                ["--baseline", "CLEAN..."] if "baseline" in self.record.get("inputs", {}) else []
            )
            return self._calibrate_again(*clean, "--out", self.path, "--resume")
        try:
            made = json.loads(read_result(self.path / RESULTS[step]).attrs["made_from"])
        except (OSError, ValueError):
            return command(step, self.path)
        usual = CriticismSettings() if step == "criticise" else PourSettings()
        files = {name: list(made.get(name, ())) for name in ("held_out", "baseline", "pours")}
        options = _options(
            {**made.get("settings", {}), **files}, {**asdict(usual), **dict.fromkeys(files)}
        )
        forced = ["--force"] if made.get("forced") else []
        return command(step, self.path, *options, *forced)

    def _calibrate_again(self, *words: object) -> str:
        """The command that calibrates on the kept recordings, with the settings of the run."""
        recordings = kept_paths(self.path, self.record) or ("RECORDING...",)
        options = _options(self.record.get("settings", {}), asdict(CalibrationSettings()))
        return command("calibrate", *recordings, *words, *options)

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
        why = self._stale(step, json.loads(tree.attrs["made_from"]))
        return (None, f"{path.name} {why}") if why else (tree, "")

    def _stale(self, step: str, made_from: Mapping[str, Any]) -> str:
        """The first difference of a result from the run; "" where it is current."""
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
        return ""

    def _check_generation(self) -> None:
        """Refuse a run of another version of fluid or engine.

        Raises:
            InputError: Versions differ; the message has the command that calibrates anew.
        """
        now, simulators = generations(), self.record.get("simulator", {}).values()
        held = {
            "model": {str(one.get("model")) for one in simulators if "model" in one},
            "engine": {str(one) for one in [self.record.get("engine", {}).get("version")] if one},
        }
        for part, versions in held.items():
            if not versions <= {str(now[part])}:
                if "files" not in self.record:  # of a check
                    what, fix = f"was made by another {part}", "choose another `out`"
                    raise InputError(what, where=str(self.path), fix=fix)
                anew = self.path.with_name(f"{self.path.name}_{part}_{now[part]}")
                raise InputError(
                    f"was made by {part} {', '.join(sorted(versions))}, and this is {now[part]}",
                    where=str(self.path),
                    fix=f"calibrate again: {self._calibrate_again('--out', anew)}",
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
        "holds no run to resume", where=str(path), fix=f"{fix} a new run, leave --resume out"
    )


def _run_near(path: Path) -> Path | None:
    """A run that may have been meant: within the directory, around it, or of a name like it."""
    around = (*sorted(path.glob(f"*/{RUN_TOML}")), path.parent / RUN_TOML)
    if found := [one.parent for one in around if one.exists()]:
        return found[0]
    beside = {one.parent.name: one.parent for one in path.parent.glob(f"*/{RUN_TOML}")}
    return next((beside[name] for name in get_close_matches(path.name, beside, n=1)), None)


def _read(path: Path) -> dict[str, Any]:
    """run.toml.

    Raises:
        InputError: There is none, or it is not TOML.
    """
    file = path / RUN_TOML
    if not file.is_file():
        raise InputError(
            f"no {RUN_TOML} in it",
            where=str(path),
            fix="give the directory of a run, as made by: bolfi-liquids calibrate ... --out RUN",
        )
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as err:
        raise InputError(f"not TOML ({err})", where=str(file), fix="restore the file") from err


def _check_no_results(path: Path) -> None:
    """Raise `InputError` where results lie without the settings that made them."""
    for name in OWN_FILES:
        if (path / name).exists():
            raise InputError(
                f"holds {name} without {RUN_TOML}",
                where=str(path),
                fix="choose another `out`; nothing was overwritten",
            )


def _write(path: Path, record: Mapping[str, Any]) -> None:
    write_text(path / RUN_TOML, tomli_w.dumps(record))


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
