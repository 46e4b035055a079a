"""What a criticism is given, read and checked."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..calibration.baseline import Baseline, Part, parts_of, recording_of
from ..calibration.model_error import check_beside
from ..calibration.result import Calibration
from ..calibration.stirs import camera_noise, names_of_effects
from ..errors import Argument, InputError
from ..inputs.pour_table import Pours, PourTable, check_scene, table_and_cups, table_of
from ..inputs.recording import Recording
from ..inputs.settings import FALSE_ALARM_RATE, CriticismSettings
from ..motions import Motion, family
from ..simulators import StirSimulator, effect_versions, stir_simulator

if TYPE_CHECKING:
    from ..inference.criticism import AutoregressiveNoise
    from ..models import Cups

PROPOSED_STIRS = 7
"""Motions that are considered as the next stir, beside a pour."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """Everything that decides a criticism.

    Attributes:
        after: Key of the posterior that is criticised.
        stirring: What the run was calibrated on.
        held_out: Recordings of the same liquid that nothing is fitted to.
        baseline: Clean recordings, none of those before, and files of such.
        clean: The recordings in all of them, but those before.
        left_out: Names of recordings that were given as clean, but are criticised or held out.
        table: Pours of the liquid, if there are any.
        held_out_table: Pours of the liquid that nothing is fitted to, if there are any.
        cups: With which they were poured.
        settings: The rest.
    """

    after: str
    stirring: StirSimulator
    held_out: tuple[Recording, ...]
    baseline: tuple[Recording | Baseline, ...]
    clean: tuple[Part, ...]
    left_out: tuple[str, ...]
    table: PourTable | None
    held_out_table: PourTable | None
    cups: "Cups"
    settings: CriticismSettings

    @property
    def compared(self) -> tuple[Recording, ...]:
        """Recordings beside those that were calibrated on."""
        return (*self.held_out, *map(recording_of, self.clean))

    @property
    def density(self) -> float:
        """Density of the liquid [kg/m3]."""
        return self.stirring.recordings[0].number("liquid_density")

    @cached_property
    def cameras(self) -> "AutoregressiveNoise":
        """Their noise in the stirs."""
        return camera_noise(self.stirring.recordings)

    @cached_property
    def motions(self) -> list[Motion]:
        """Stirs that could be made next."""
        return family(self.stirring, PROPOSED_STIRS)

    @property
    def level(self) -> float:
        """p-value below which a source is rejected, so that all of them share one error rate."""
        return FALSE_ALARM_RATE if self.table is None else FALSE_ALARM_RATE / 2.0

    @property
    def made_from(self) -> dict[str, Any]:
        """Settings, and the name of every file by its SHA-256, that decide a result, as JSON."""
        files = {
            "recordings": self.stirring.recordings,
            "held_out": self.held_out,
            "baseline": self.baseline,
            "pours": [self.table],
            "held_out_pours": [self.held_out_table],
        }
        made_from = {
            "after": self.after,
            "version": version("bolfi-liquids"),
            # how many are simulated together changes no result
            "settings": {k: v for k, v in asdict(self.settings).items() if k != "batch"},
            "considered": [
                effect_versions(names_of_effects(scene, self.settings.effects))
                for scene in ("stir", "pour")
            ],
            **{
                group: {one.hash: one.path.name for one in some if one is not None}
                for group, some in files.items()
            },
            "left_out": list(self.left_out),
            "poured": self.table and {"liquid": self.table.liquid, "cups": self.cups.settings()},
        }
        return json.loads(json.dumps(made_from))  # as it will be read


def open_inputs(
    calibration: Calibration,
    settings: CriticismSettings,
    held_out: list[Recording],
    baseline: list[Recording | Baseline],
    poured: tuple[Pours | None, Pours | None] = (None, None),
    cups: "Cups | str | Path | None" = None,
) -> Inputs:
    """Read what is given as a path, and check all of it.

    Args:
        calibration: What is criticised.
        settings, held_out, baseline, cups: See `criticise`.
        poured: Its `pours` and `held_out_pours`.

    Raises:
        InputError: Something cannot be used.
    """
    particles = int(calibration.record["settings"]["particles"])
    stirring = stir_simulator(calibration.run.recordings, particles)
    check_beside(stirring, held_out, "held_out")
    used = (*stirring.recordings, *held_out)
    clean, left_out = parts_of(baseline, used, particles)
    check_beside(stirring, list(map(recording_of, clean)), "baseline")
    others = {one.hash: one for one in baseline if one.hash not in {two.hash for two in used}}
    table, cups = table_and_cups(poured[0], cups)
    held_out_table = table_of(poured[1], Argument("held_out_pours"))
    for where, what, fix in _pours_faults(table, held_out_table):
        raise InputError(what, where=Argument(where), fix=fix)
    if held_out_table is not None:
        check_scene(held_out_table, cups)
    return Inputs(
        after=calibration.key,
        stirring=stirring,
        held_out=tuple(held_out),
        baseline=tuple(others.values()),
        clean=tuple(clean),
        left_out=tuple(left_out),
        table=table,
        held_out_table=held_out_table,
        cups=cups,
        settings=settings,
    )


def check_effects(settings: CriticismSettings, scenes: Sequence[str]) -> None:
    """Raise InputError unless the effects exist, and one acts in one of the scenes."""
    for where, what, fix in _effects_faults(settings, scenes):
        raise InputError(what, where=Argument(where), fix=fix)


def _effects_faults(
    settings: CriticismSettings, scenes: Sequence[str]
) -> Iterator[tuple[str, str, str]]:
    """Options that cannot be used, why, and what to do about each."""
    from ..models import EFFECTS

    acting = [name for scene in scenes for name in names_of_effects(scene)]
    considered = settings.effects or tuple(EFFECTS)
    for name in considered:
        if name not in EFFECTS:
            yield "effects", f"there is no effect {name}", f"choose from {', '.join(EFFECTS)}"
    if not set(considered) & set(acting):
        what = f"none of the effects acts in a {' or in a '.join(scenes)}"
        pours = "" if "pour" in scenes else ", or give `pours` in which they act"
        yield "effects", what, f"choose from {', '.join(dict.fromkeys(acting))}{pours}"
    for name in settings.accept or ():
        if name not in considered:
            what = f"{name!r} is none of the effects that are considered"
            yield "accept", what, f"choose from {', '.join(considered)}"


def _pours_faults(
    table: PourTable | None, held_out: PourTable | None
) -> Iterator[tuple[str, str, str]]:
    """Arguments about pours that cannot be used, why, and what to do about each."""
    if held_out is not None:
        where = f"held_out_pours {held_out.path}"
        if table is None:
            yield where, "there are no pours to learn from", "give some with `pours`"
        elif held_out.hash == table.hash:
            fix = "hold out other pours: nothing can be proved on data that were fitted"
            yield where, "holds the pours that are fitted", fix
