"""`check physics --against`: the fluid against stirs that a reference solver made."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..files import write_text
from ..inputs.settings import checked_seed
from ..models.accuracy import LARGEST_ERRORS
from . import replay
from .case_files import CaseFiles, results_folder
from .case_runner import Setting, run_unfinished
from .neighbours import LEAST_JUDGED, MAX_DIFFERENCE, Neighbours, neighbours
from .physics_records import made_with, plain, without_panels
from .reference_stirs import Reference, ReferenceStir
from .replay import Simulate, repeated, replay_case

if TYPE_CHECKING:
    from ..inference.simulations import Workers

STIRS = "against"
RESULTS = "against.json"


@dataclass(frozen=True)
class Replays:
    """What is to be repeated, and by what.

    Attributes:
        reference: All recordings.
        names: Of those to repeat, with or without the ending of a file; none for all.
        simulate: Repeats a stir.
    """

    reference: Reference
    names: tuple[str, ...] = ()
    simulate: Simulate = repeated


@dataclass(frozen=True)
class AgainstCheck:
    """What a check found.

    Attributes:
        path: Directory with the results file, records and plots.
        records: Of the recordings asked for, from the thinnest liquid to the thickest.
        neighbours: Pairs of these whose liquids follow each other in viscosity in the reference.
        left_out: Name -> hidden effect of recordings that are not repeated.
        ran: Names of those that ran now; the others had finished before.
    """

    path: Path
    records: tuple[dict[str, Any], ...]
    neighbours: tuple[Neighbours, ...]
    left_out: Mapping[str, str]
    ran: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Every recording and every pair keeps its bars."""
        return _passed(self.records, self.neighbours)

    @property
    def results(self) -> Path:
        """The results file."""
        return self.path / RESULTS


def check_against(
    out: str | Path,
    replays: Replays,
    *,
    seed: int = 0,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> AgainstCheck:
    """Repeat a reference's recordings, those that have not finished in `out` before.

    A recording that raises costs itself alone and is tried again by the next check. Every record
    is kept at once, so a check that was killed goes on where it was.

    Args:
        out: Directory of results; made if missing.
        replays: Recordings, and what simulates them.
        seed: Decides the seeds of the simulations, `replay.SEEDS` of them.
        executor: Runs each recording in a call of its own, see `calibrate`; None is this process.
        timeout: Seconds that one recording may take; None sets no limit.
        progress: Whether to show progress on stderr.

    Raises:
        InputError: an unknown name, a negative seed, or a directory that holds something else.
    """
    reference = replays.reference
    chosen = reference.chosen(replays.names)
    cases = {stir.name: replay_case(stir, replays.simulate) for stir in reference.stirs}
    setting = Setting(checked_seed(seed), timeout, executor, progress)
    out = results_folder(out)
    files = CaseFiles(out / STIRS, out / STIRS)
    files.make()

    def keep() -> None:
        held = list(files.of_today(cases.values(), setting.seed))
        _write_results(out / RESULTS, reference, held, setting.seed)

    records, ran = run_unfinished([cases[stir.name] for stir in chosen], files, setting, keep)
    pairs = _neighbours(reference.stirs, records)
    return AgainstCheck(out, records, pairs, reference.left_out, ran)


def _neighbours(
    stirs: Iterable[ReferenceStir], records: Iterable[Mapping[str, Any]]
) -> tuple[Neighbours, ...]:
    return neighbours(stirs, {record["name"]: record for record in records})


def _passed(records: Iterable[Mapping[str, Any]], pairs: Iterable[Neighbours]) -> bool:
    return all(record["passed"] for record in records) and all(pair.passed for pair in pairs)


def _write_results(
    path: Path, reference: Reference, records: Sequence[Mapping[str, Any]], seed: int
) -> None:
    """All that the directory holds of a reference, without the points of plots."""
    pairs = _neighbours(reference.stirs, records)
    results = {
        **made_with(seed),
        "reference": {"directory": reference.path.resolve().name, "truths": reference.hash},
        "settings": _settings(),
        "passed": _passed(records, pairs),
        "recordings": without_panels(records),
        "neighbours": [pair.to_json() for pair in pairs],
        "left_out": dict(reference.left_out),
    }
    write_text(path, json.dumps(results, indent=2, allow_nan=False) + "\n")


def _settings() -> dict[str, Any]:
    """Bars and what else decides the verdicts; no upper limit of viscosity is null."""
    return plain(
        {
            "seeds": replay.SEEDS,
            "noise_deg": replay.CAMERA_NOISE,
            "rms_bars": [
                {"viscosity_below": limit, "max_deg": bar} for limit, bar in LARGEST_ERRORS
            ],
            "max_spread_deg": replay.MAX_SPREAD,
            "max_ratio_difference": MAX_DIFFERENCE,
            "least_judged_deg": LEAST_JUDGED,
        }
    )
