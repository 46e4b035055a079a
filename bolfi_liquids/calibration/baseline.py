"""What clean recordings show of the simulator's error on a rig, learned once and kept as a file.

A group `clean_1`, `clean_2` and so on holds each recording: its own variables and attributes with
`file` and `sha256`, and beside them the simulator's `residual` and the `viscosity` that was found.
"""

import json
import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Argument, InputError
from ..files import existing_file, new_file
from ..inputs.frame import recording_warnings
from ..inputs.open import Source, open_recording, open_recordings
from ..inputs.prior import default_prior, describe_prior
from ..inputs.recording import (
    PLANE_NAMES,
    UNITS,
    Recording,
    as_recording,
    recording_dataset,
)
from ..inputs.settings import BaselineSettings, CriticismSettings
from ..inputs.toml_file import opened
from ..progress import phases
from ..run.compute import open_compute
from ..run.results import generations, is_result, read_result, write_result
from ..simulators import stir_simulator
from .model_error import Clean, check_beside, clean_residuals
from .stirs import camera_noise

if TYPE_CHECKING:
    from xarray import Dataset

    from ..inference import Prior
    from ..inference.simulations import Workers

logger = logging.getLogger(__name__)

BANK = ".sqlite"
"""Ending of the simulations that are kept beside a baseline."""

GROUP = "clean_"
"""Start of a clean recording's group; its number follows."""

FIX = "make it again: bolfi-liquids baseline RECORDING... --out FILE"


@dataclass(frozen=True, eq=False)
class Baseline:
    """The simulator's error on clean recordings of a rig, see `learn_baseline`.

    Attributes:
        path: The file.
        clean: Each recording, and what the simulator leaves of it.
        made_from: Settings, versions, and the name of every recording by its SHA-256.
    """

    path: Path
    clean: tuple[Clean, ...]
    made_from: Mapping[str, Any]

    @property
    def hash(self) -> str:
        """Digest of what it was made from."""
        return sha256(json.dumps(self.made_from, sort_keys=True).encode()).hexdigest()

    @property
    def particles(self) -> int:
        """Of the simulator; 0 where cells follow the stick."""
        return self.made_from["settings"]["particles"]

    @classmethod
    def open(cls, path: str | Path) -> "Baseline":
        """Read a baseline.

        Raises:
            InputError: It is damaged or another file, or another version of the fluid or of the
                engine made it.
        """
        path = existing_file(path)
        try:
            tree = read_result(path)
            made_from = json.loads(tree.attrs["made_from"])
            settings = made_from["settings"]
            _ = settings["particles"], settings["prior"]
            made_by = {part: made_from[part] for part in generations()}
            clean = tuple(_read(group.to_dataset(), path) for group in tree.children.values())
        except (OSError, TypeError, ValueError, LookupError) as err:
            what = "is damaged, or was not made by `bolfi-liquids baseline`"
            raise InputError(what, where=str(path), fix=FIX) from err
        for part, now in generations().items():
            if made_by[part] != now:
                of = "fluid" if part == "model" else part
                what = f"was made by version {made_by[part]} of the {of}, which is now {now}"
                raise InputError(what, where=str(path), fix=FIX)
        return cls(path, clean, made_from)


CleanSource = Source | Baseline
"""A clean recording, whose residual has to be learned, or a baseline; or the path of one."""

Part = Recording | Clean
"""A clean recording, whose residual has to be learned or is known."""


def learn_baseline(
    recordings: Source | Sequence[Source],
    *,
    out: str | Path,
    particles: int = BaselineSettings.particles,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Baseline:
    """Learn the simulator's error on a rig once, for all runs on it, and keep it as a file.

    Simulations are kept beside the file, under its name with the ending `.sqlite`: a call that was
    interrupted, or that has further recordings, repeats none of them. The same call on a finished
    file only opens it; a damaged baseline, and one of another version, is made anew. Liquids have
    the default prior.

    Args:
        recordings: Clean ones, in which no effect is believed to be missing, of any liquids.
        out: The file, in `.nc`.
        particles: As given to `calibrate`.
        executor, timeout: See `calibrate`.
        progress: Whether to show phases on stderr.

    Raises:
        InputError: A recording cannot be used, or is of another rig than the first; or a setting,
            `timeout` or `out` cannot be used, or `out` is a file but no baseline.
        ValueError, ImportError, ConnectionError: `executor` cannot be used.
        RuntimeError: Simulations failed; the message says how.
    """
    from xarray import DataTree

    from ..inference import SimulationBank

    settings, path = BaselineSettings(particles), new_file(out, Argument("out"), suffix=".nc")
    held = _held(path)
    clean = list({one.hash: one for one in open_recordings(recordings)}.values())
    if not clean:
        raise InputError("no recording given", where="recordings", fix="give at least one")
    check_beside(stir_simulator(clean[:1], particles), clean[1:], "baseline")
    for one in clean:
        camera_noise([one])  # refuses one that rests too shortly
    prior = default_prior()
    made_from = {
        "recordings": {one.hash: one.path.name for one in clean},
        "settings": asdict(settings) | {"prior": describe_prior(prior)},
        **generations(),
    }
    wanted = Baseline(path, (), made_from)
    if held and held.hash == wanted.hash:
        return held
    for notice in recording_warnings(clean):
        logger.warning(notice)
    with (
        open_compute(executor, timeout) as compute,
        SimulationBank(path.with_suffix(BANK)) as bank,
        phases(shown=progress) as report,
    ):
        own = replace(compute, batch=CriticismSettings.batch, bank=bank)
        learned = clean_residuals(clean, particles, prior, own, report)
    groups = {f"{GROUP}{at}": _dataset(one) for at, one in enumerate(learned, start=1)}
    tree = DataTree.from_dict(groups)
    tree.attrs["made_from"] = json.dumps(made_from)
    write_result(tree, path)
    return Baseline(path, tuple(learned), made_from)


def _held(path: Path) -> Baseline | None:
    """The baseline in a file; None where there is none, or it has to be made anew."""
    if not path.exists():
        return None
    if not _was_baseline(path):
        fix = "choose another name, or move that file away"
        raise InputError("exists already, and is no baseline", where=str(path), fix=fix)
    try:
        return Baseline.open(path)
    except InputError:
        return None


def _was_baseline(path: Path) -> bool:
    """Whether `learn_baseline` wrote a file, or any command one that is damaged."""
    if not is_result(path):
        return False
    try:
        groups = read_result(path).children
    except (OSError, ValueError):
        return True
    return bool(groups) and all(name.startswith(GROUP) for name in groups)


def open_clean(sources: CleanSource | Iterable[CleanSource]) -> list[Recording | Baseline]:
    """Read clean recordings and baselines, in any mixture, given opened or as paths.

    Raises:
        InputError: One of them cannot be used.
    """
    several = [sources] if isinstance(sources, CleanSource) else sources
    where, cure = Argument("baseline"), "recordings or baselines, or their paths"

    def open_either(path: str | Path) -> Any:
        return (Baseline.open if is_result(existing_file(path)) else open_recording)(path)

    return [
        one
        if isinstance(one, Baseline)
        else opened(one, Recording, open_either, where, "clean recording", cure)
        for one in several
    ]


def parts_of(
    given: Sequence[Recording | Baseline], used: Sequence[Recording], particles: int
) -> tuple[list[Part], list[str]]:
    """The clean recordings in all of them, each once, and the names of those that are used.

    Args:
        given: Recordings, and baselines that hold several.
        used: Recordings that are fitted or held out, which are no clean ones beside.
        particles: Of the simulator, 0 where cells follow the stick.

    Raises:
        InputError: A baseline was made with another number of particles.
    """
    parts: dict[str, Part] = {}
    for one in given:
        if isinstance(one, Recording):
            parts.setdefault(one.hash, one)
            continue
        if one.particles != particles:
            raise InputError(
                f"was made with particles = {one.particles}, but the run with {particles}",
                where=Argument(f"baseline {one.path}"),
                fix=f"make one with --particles {particles}, or give its recordings",
            )
        parts |= {part.recording.hash: part for part in one.clean}
    digests = {one.hash for one in used}
    names = [recording_of(part).path.name for key, part in parts.items() if key in digests]
    return [part for key, part in parts.items() if key not in digests], names


def prior_warnings(given: Sequence[Recording | Baseline], prior: "Prior") -> list[str]:
    """A warning for each baseline whose liquids had another prior than a run's."""
    described = json.loads(json.dumps(describe_prior(prior)))
    return [
        f"{one.path}: its liquids had another prior than the run's; give its recordings instead to "
        "learn them with the run's"
        for one in given
        if isinstance(one, Baseline) and one.made_from["settings"]["prior"] != described
    ]


def recording_of(part: Part) -> Recording:
    """The recording itself."""
    return part if isinstance(part, Recording) else part.recording


def _dataset(clean: Clean) -> "Dataset":
    """The group of a clean recording."""
    recording = clean.recording
    named = {"file": recording.path.name, "sha256": recording.hash}
    values = {name: recording.values(name) for name in UNITS}
    return recording_dataset(values, {**recording.attrs, **named}).assign(
        residual=(("time", "plane"), clean.residual, {"units": "rad"}),
        viscosity=((), clean.viscosity, {"units": "Pa s"}),
        plane=list(PLANE_NAMES),
    )


def _read(group: "Dataset", path: Path) -> Clean:
    """The clean recording of a group, of which nothing was simulated here.

    Its path is one within the baseline at `path`: messages name the file that was given, too.
    """
    named = path / group.attrs.pop("file"), group.attrs.pop("sha256")
    recording = replace(as_recording(group, named[0], b""), hash=named[1])
    return Clean(recording, group["residual"].to_numpy(), float(group["viscosity"]), 0)
