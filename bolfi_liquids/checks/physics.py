"""`check physics`: the fluid against everything that is known about it."""

import time
import traceback
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..files import write_text
from ..progress import fraction_bar
from .physics_identity import case_identity, has_identity
from .physics_records import (
    CASES,
    RESULTS,
    failed_record,
    finished_record,
    is_finished,
    read_record,
    write_record,
    write_results,
)

if TYPE_CHECKING:
    from ..models.validation import Case


@dataclass(frozen=True)
class PhysicsCheck:
    """What a check found.

    Attributes:
        path: Directory with the results file, records and plots.
        records: Of the cases asked for, in order, as in the results file.
        ran: Names of those that ran now; the others had finished before.
    """

    path: Path
    records: tuple[dict[str, Any], ...]
    ran: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Every case finished within its tolerances."""
        return all(record["passed"] for record in self.records)

    @property
    def results(self) -> Path:
        """The results file."""
        return self.path / RESULTS


def all_cases() -> "dict[str, Case]":
    """Every case, by name: those of the models, then those on recordings."""
    from ..models.validation import cases, discover
    from . import cases as physics_cases

    return discover(cases, physics_cases)


def check_physics(
    out: str | Path,
    names: Iterable[str] = (),
    *,
    seed: int = 0,
    cases: "Mapping[str, Case] | None" = None,
    progress: bool = True,
) -> PhysicsCheck:
    """Run validation cases, those that have not finished in `out` before.

    A case that raises costs itself alone: it is recorded with its error and tried again by the
    next check. Everything is kept at once, so a check that was killed goes on where it was.

    Args:
        out: Directory of results; made if missing.
        names: Cases to run; none for all.
        seed: Of the cases' initial packings.
        cases: The registry; None for all there are.
        progress: Show it on stderr.

    Raises:
        InputError: an unknown name, a negative seed, or a directory that holds something else.
    """
    registry = all_cases() if cases is None else cases
    chosen = _chosen(names, registry)
    if seed < 0:
        raise InputError(f"is {seed}", where="--seed", fix="give an integer of at least 0")
    out = Path(out)
    if out.exists() and not out.is_dir():
        raise InputError("not a directory", where=str(out), fix="choose another --out")
    (out / CASES).mkdir(parents=True, exist_ok=True)

    held = [read_record(out, case.name) for case in chosen]
    records, ran = [], []
    for number, (case, record) in enumerate(zip(chosen, held, strict=True), 1):
        if record is None or not is_finished(record, case_identity(case, seed)):
            label = f"{case.name} ({number} of {len(chosen)})"
            record = _run(case, seed, label, shown=progress)
            write_record(out, record)
            ran.append(case.name)
            _plot_path(out, case.name).unlink(missing_ok=True)
        _plot(out, record)
        records.append(record)
        write_results(out, _all_records(out, registry, seed), seed)
    return PhysicsCheck(out, tuple(records), tuple(ran))


def _chosen(names: Iterable[str], registry: "Mapping[str, Case]") -> "list[Case]":
    wanted = list(dict.fromkeys(names))
    for name in wanted:
        if name not in registry:
            raise InputError(
                f"no case {name!r}", where="--case", fix=f"choose from {', '.join(registry)}"
            )
    return [registry[name] for name in wanted or registry]


def _run(case: "Case", seed: int, label: str, *, shown: bool) -> dict[str, Any]:
    """The record of one case, which ran or failed."""
    began = time.perf_counter()
    with fraction_bar(label, shown=shown) as tell:
        try:
            result = case.run(tell, seed)
            return finished_record(case, result, seed, time.perf_counter() - began)
        except Exception as err:  # whatever it is, the other cases are still worth running
            seconds = time.perf_counter() - began
            said = " ".join(str(err).split())
            record = failed_record(case, f"{type(err).__name__}: {said}", seed, seconds)
            return record | {"traceback": traceback.format_exc()}


def _all_records(out: Path, registry: "Mapping[str, Case]", seed: int) -> Iterator[dict[str, Any]]:
    """What the directory holds of today's cases, from this check or one before."""
    for name, case in registry.items():
        record = read_record(out, name)
        if record is not None and has_identity(record, case_identity(case, seed)):
            yield record


def _plot_path(out: Path, name: str) -> Path:
    return out / f"{name}.svg"


def _plot(out: Path, record: Mapping[str, Any]) -> None:
    """Draw what is not drawn yet: a check may have died between the record and its plot."""
    path = _plot_path(out, record["name"])
    if record["panels"] and not path.exists():
        from .physics_figure import physics_figure

        write_text(path, physics_figure(record))
