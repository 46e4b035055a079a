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
from ..inputs.prior import check_prior, default_prior, describe_prior
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
            InputError: It is damaged or another file, or another version of the fluid made it.
        """
        path = existing_file(path)
        try:
            tree = read_result(path)
            made_from = json.loads(tree.attrs["made_from"])
            model, groups = made_from["model"], tree.children.values()
            clean = tuple(_read(group.to_dataset()) for group in groups)
        except (OSError, ValueError, LookupError) as err:
            what = "is damaged, or was not made by `bolfi-liquids baseline`"
            raise InputError(what, where=str(path), fix=FIX) from err
        if model != (now := generations()["model"]):
            what = f"was made by version {model} of the fluid, which is now {now}"
            raise InputError(what, where=str(path), fix=FIX)
        return cls(path, clean, made_from)


CleanSource = Source | Baseline
"""A clean recording, whose residual has to be learned, or a baseline; or the path of one."""

Part = Recording | Clean
"""A clean recording, whose residual has to be learned or is known."""


def learn_baseline(  # noqa: PLR0913  as other steps are called
    recordings: Source | Sequence[Source],
    *,
    out: str | Path,
    particles: int = BaselineSettings.particles,
    prior: "Prior | None" = None,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Baseline:
    """Learn the simulator's error on a rig once, for all runs on it, and keep it as a file.

    Simulations are kept beside the file, under its name with the ending `.sqlite`: a call that was
    interrupted, or that has further recordings, repeats none of them. The same call on a finished
    file only opens it.

    Args:
        recordings: Clean ones, in which no effect is believed to be missing, of any liquids.
        out: The file, in `.nc`.
        particles: As given to `calibrate`.
        prior: Of the liquids; None is that of `calibrate`.
        executor, timeout: See `calibrate`.
        progress: Whether to show phases on stderr.

    Raises:
        InputError: A recording cannot be used, or is of another rig than the first; or the prior, a
            setting, `timeout` or `out` cannot be used.
        ValueError, ImportError, ConnectionError: `executor` cannot be used.
        RuntimeError: Simulations failed; the message says how.
    """
    from xarray import DataTree

    from ..inference import SimulationBank

    settings, path = BaselineSettings(particles), new_file(out, Argument("out"), suffix=".nc")
    clean = list({one.hash: one for one in open_recordings(recordings)}.values())
    if not clean:
        raise InputError("no recording given", where="recordings", fix="give at least one")
    check_beside(stir_simulator(clean[:1], particles), clean[1:], "baseline")
    for one in clean:
        camera_noise([one])  # refuses one that rests too shortly
    prior = default_prior() if prior is None else prior
    check_prior(prior)
    made_from = {
        "recordings": {one.hash: one.path.name for one in clean},
        "settings": asdict(settings) | {"prior": describe_prior(prior)},
        **generations(),
    }
    wanted = Baseline(path, (), made_from)
    if path.exists() and is_result(path) and (held := Baseline.open(path)).hash == wanted.hash:
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
    groups = {f"clean_{at}": _dataset(one) for at, one in enumerate(learned, start=1)}
    tree = DataTree.from_dict(groups)
    tree.attrs["made_from"] = json.dumps(made_from)
    write_result(tree, path)
    return Baseline(path, tuple(learned), made_from)


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


def _read(group: "Dataset") -> Clean:
    """The clean recording of a group, of which nothing was simulated here."""
    named = Path(group.attrs.pop("file")), group.attrs.pop("sha256")
    recording = replace(as_recording(group, named[0], b""), hash=named[1])
    return Clean(recording, group["residual"].to_numpy(), float(group["viscosity"]), 0)
