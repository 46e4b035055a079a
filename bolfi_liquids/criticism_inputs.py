"""What a criticism is given, read and checked."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .calibration import Calibration
from .cups import bundled_cups
from .errors import InputError
from .pour_table import PourTable, open_pours
from .recordings import Recording, Source, open_recordings
from .recordings_kept import kept_recordings
from .settings import CriticismSettings
from .stirring import Stirring, same_liquid, stirring_of

if TYPE_CHECKING:
    from .models import Cups


@dataclass(frozen=True, eq=False)
class Inputs:
    """What decides a criticism.

    Attributes:
        stirring: What the run was calibrated on.
        held_out: Recordings of the same liquid that nothing is fitted to.
        baseline: Recordings believed to lack nothing; none of those before.
        table: Pours of the liquid, if there are any.
        cups: With which they were poured.
        settings: The rest.
    """

    stirring: Stirring
    held_out: tuple[Recording, ...]
    baseline: tuple[Recording, ...]
    table: PourTable | None
    cups: "Cups"
    settings: CriticismSettings

    @property
    def made_from(self) -> dict[str, Any]:
        """What a result was made from, as JSON: settings, and the SHA-256 of every file."""
        groups = {
            "recordings": self.stirring.recordings,
            "held_out": self.held_out,
            "baseline": self.baseline,
            "pours": () if self.table is None else (self.table,),
        }
        return {
            "version": version("bolfi-liquids"),
            "settings": {key: _listed(value) for key, value in asdict(self.settings).items()},
            **{
                group: {one.path.name: one.hash for one in files} for group, files in groups.items()
            },
            "poured": self.table and {"liquid": self.table.liquid, "cups": self.cups.settings()},
        }


def open_inputs(
    calibration: Calibration,
    held_out: Source | Sequence[Source],
    baseline: Source | Sequence[Source],
    pours: PourTable | str | Path | None,
    cups: "Cups | None",
    settings: CriticismSettings,
) -> Inputs:
    """Read what is given as a path, and check all of it.

    Raises:
        InputError: Something cannot be used.
    """
    record = dict(calibration.record)
    stirring = stirring_of(
        kept_recordings(calibration.path, record), int(record["settings"]["particles"])
    )
    kept_back = open_recordings(held_out)
    _check_held_out(stirring, kept_back)
    return Inputs(
        stirring=stirring,
        held_out=tuple(kept_back),
        baseline=_others(open_recordings(baseline), [*stirring.recordings, *kept_back]),
        table=open_pours(pours) if isinstance(pours, str | Path) else pours,
        cups=bundled_cups() if cups is None else cups,
        settings=settings,
    )


def _others(baseline: list[Recording], used: Sequence[Recording]) -> tuple[Recording, ...]:
    """The clean recordings that are neither criticised nor held out, each once."""
    taken = {recording.hash for recording in used}
    return tuple({r.hash: r for r in baseline if r.hash not in taken}.values())


def _check_held_out(stirring: Stirring, held_out: Sequence[Recording]) -> None:
    fitted = {recording.hash for recording in stirring.recordings}
    for recording in held_out:
        if recording.hash in fitted:
            raise InputError(
                "is what the run was calibrated on",
                where=f"--held-out {recording.path}",
                fix="hold out another recording: nothing can be proved on data that were fitted",
            )
        if not same_liquid(recording, stirring.recordings[0]):
            density = stirring.recordings[0].number("liquid_density")
            raise InputError(
                f"liquid_density is {recording.number('liquid_density'):g} kg/m3, but "
                f"{density:g} in the run",
                where=f"--held-out {recording.path}",
                fix="hold out a recording of the same liquid",
            )


def _listed(value: Any) -> Any:
    """As JSON gives it back."""
    return list(value) if isinstance(value, tuple) else value
