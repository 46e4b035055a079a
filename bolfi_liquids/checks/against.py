"""`check physics --against`: the fluid against stirs and pours that a reference solver made."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Argument, InputError
from ..files import write_text
from ..inputs.settings import checked_seed
from ..models.accuracy import LARGEST_ERRORS
from . import pour_bars, pour_replay, replay
from .across_pours import across_pours
from .case_files import CaseFiles, results_folder
from .case_runner import Setting, run_unfinished
from .neighbours import LEAST_JUDGED, MAX_DIFFERENCE, Neighbours, neighbours
from .physics_records import made_with, plain, row_record, without_panels
from .pour_replay import pour_case
from .reference import Reference

if TYPE_CHECKING:
    from ..inference.simulations import Workers
    from ..models.validation import Case, Row

REPEATED = "against"
RESULTS = "against.json"
MIN_CELLS, MAX_CELLS = 3, 50  # in the radius of a source that is poured from


@dataclass(frozen=True)
class Replays:
    """What is to be repeated, and by what.

    Attributes:
        reference: All stirs and pours.
        names: Of those to repeat, see `Reference.chosen`; none for all.
        stir, pour: Repeat a stir, and the pours of a liquid.
        cell: Width of the cells of pours [m]; None leaves the simulator its own.
    """

    reference: Reference
    names: tuple[str, ...] = ()
    stir: replay.Simulate = replay.repeated
    pour: pour_replay.Simulate = pour_replay.repeated
    cell: float | None = None

    def cases(self) -> "dict[str, Case]":
        """Of all stirs and pours, by name."""
        stirs = [replay.replay_case(one, self.stir) for one in self.reference.stirs]
        pours = [pour_case(one, self.pour, self.cell) for one in self.reference.pours]
        return {case.name: case for case in (*stirs, *pours)}


@dataclass(frozen=True)
class Findings:
    """What repeated stirs and pours have shown.

    Attributes:
        stirs: Records of recordings, from the thinnest liquid to the thickest.
        neighbours: Pairs of these whose liquids follow each other in viscosity in the reference.
        pours: Records of liquids that were poured, from the thinnest to the thickest.
        across_pours: Comparisons that need several of these.
    """

    stirs: tuple[dict[str, Any], ...]
    neighbours: tuple[Neighbours, ...]
    pours: tuple[dict[str, Any], ...]
    across_pours: "tuple[Row, ...]"

    @property
    def records(self) -> tuple[dict[str, Any], ...]:
        """Of stirs and pours."""
        return self.stirs + self.pours

    @property
    def passed(self) -> bool:
        """Everything keeps its bars."""
        rows = (*self.neighbours, *self.across_pours)
        return all(record["passed"] for record in self.records) and all(row.passed for row in rows)


@dataclass(frozen=True)
class AgainstCheck(Findings):
    """What a check found of the stirs and pours asked for.

    Attributes:
        path: Directory with the results file, records and plots.
        left_out: Name -> hidden effect of recordings that are not repeated.
        ran: Names of those that ran now; the others had finished before.
    """

    path: Path
    left_out: Mapping[str, str]
    ran: tuple[str, ...]

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
    """Repeat a reference's stirs and pours, those that have not finished in `out` before.

    One that raises costs itself alone and is tried again by the next check. Every record is kept
    at once, so a check that was killed goes on where it was.

    Args:
        out: Directory of results; made if missing.
        replays: Stirs and pours, and what simulates them.
        seed: Decides the seeds of the simulations, `replay.SEEDS` of a stir, one of a pour.
        executor: Runs each recording, and all pours of a liquid, in a call of their own, see
            `calibrate`; None is this process.
        timeout: Seconds that one such call may take; None sets no limit.
        progress: Whether to show progress on stderr.

    Raises:
        InputError: an unknown name, a negative seed, cells that do not fit the cup, or a directory
            that holds something else.
    """
    reference = replays.reference
    chosen = reference.chosen(replays.names)
    _check_cell(replays)
    cases = replays.cases()
    setting = Setting(checked_seed(seed), timeout, executor, progress)
    out = results_folder(out)
    files = CaseFiles(out / REPEATED, out / REPEATED)
    files.make()

    def keep() -> None:
        held = files.of_today(cases.values(), setting.seed)
        _write_results(out / RESULTS, reference, _findings(reference, held), setting.seed)

    records, ran = run_unfinished([cases[one.name] for one in chosen], files, setting, keep)
    found = _findings(reference, records)
    return AgainstCheck(**vars(found), path=out, left_out=reference.left_out, ran=ran)


def _check_cell(replays: Replays) -> None:
    """Refuse cells that are too wide for a cup, or so narrow that no computer holds them."""
    if replays.cell is None:
        return
    if not replays.reference.pours:
        fix = "leave it out; stirs have cells of their own"
        raise InputError("there are no pours", where=Argument("cell"), fix=fix)
    narrowest = min(one.cups.source.radius for one in replays.reference.pours)
    low, high = narrowest / MAX_CELLS, narrowest / MIN_CELLS
    if not low <= replays.cell <= high:
        raise InputError(
            f"{1e3 * replays.cell:g} mm is not between {1e3 * low:.2g} and {1e3 * high:.2g} mm",
            where=Argument("cell"),
            fix=f"give a source {MIN_CELLS} to {MAX_CELLS} cells in its radius",
        )


def _findings(reference: Reference, records: Iterable[dict[str, Any]]) -> Findings:
    by_name = {record["name"]: record for record in records}
    stirs, pours = (
        tuple(by_name[one.name] for one in part if one.name in by_name)
        for part in (reference.stirs, reference.pours)
    )
    return Findings(
        stirs,
        neighbours(reference.stirs, by_name),
        pours,
        across_pours(reference.pours, by_name),
    )


def _write_results(path: Path, reference: Reference, found: Findings, seed: int) -> None:
    """All that the directory holds of a reference, without the points of plots."""
    results = {
        **made_with(seed),
        "reference": {"directory": reference.path.resolve().name, "truths": dict(reference.hashes)},
        "settings": _settings(),
        "passed": found.passed,
        "recordings": without_panels(found.stirs),
        "neighbours": [pair.to_json() for pair in found.neighbours],
        "left_out": dict(reference.left_out),
        "pours": without_panels(found.pours),
        "across_pours": plain([row_record(row) for row in found.across_pours]),
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
            "pours": {
                "judged_spillage": pour_bars.JUDGED_SPILLAGE,
                "max_rms": pour_bars.MAX_RMS,
                "max_mean_rms": pour_bars.MAX_MEAN_RMS,
                "max_landing_error_mm": 1e3 * pour_bars.MAX_LANDING_ERROR,
                "max_retained_error": pour_bars.MAX_RETAINED_ERROR,
                "max_excess": pour_bars.MAX_EXCESS,
                "max_mean_excess": pour_bars.MAX_MEAN_EXCESS,
                "max_shift_errors": [
                    {"viscosity_below": limit, "max_mm": 1e3 * error}
                    for limit, error in pour_bars.MAX_SHIFT_ERRORS
                ],
            },
        }
    )
