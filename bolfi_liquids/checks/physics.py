"""`check physics`: the fluid against analytic solutions and measurements."""

import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import Argument, InputError
from ..files import given_path, write_text
from ..inputs.settings import checked_seed
from ..progress import fraction_bar, progress_bar
from ..run.workers import open_workers
from .physics_records import (
    CASES,
    RESULTS,
    case_identity,
    failed_record,
    finished_record,
    has_identity,
    is_finished,
    read_record,
    write_record,
    write_results,
)

if TYPE_CHECKING:
    from ..inference.simulations import Workers
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
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> PhysicsCheck:
    """Run validation cases, those that have not finished in `out` before.

    A case that raises costs itself alone: it is recorded with its error and tried again by the
    next check. So is what a pool had not finished when one of its processes died. Every record is
    kept at once, so a check that was killed goes on where it was.

    Args:
        out: Directory of results; made if missing.
        names: Cases to run; none for all.
        seed: Seed of the cases' initial packings.
        executor: Runs each case in a call of its own, see `calibrate`; None is this process.
        timeout: Seconds that one case may take; None sets no limit.
        progress: Whether to show progress on stderr.

    Raises:
        InputError: an unknown name, a negative seed, or a directory that holds something else.
    """
    registry = all_cases()
    chosen = _chosen(names, registry)
    seed = checked_seed(seed)
    out = given_path(out, Argument("out"))
    if out.exists() and not out.is_dir():
        raise InputError("not a directory", where=str(out), fix="choose another `out`")
    (out / CASES).mkdir(parents=True, exist_ok=True)

    held = {case.name: read_record(out, case.name) for case in chosen}
    records = {name: record for name, record in held.items() if record is not None}
    missing = [case for case in chosen if not _is_held(held[case.name], case, seed)]
    with open_workers(executor, timeout) as workers:
        for record in _run_all(missing, _Setting(seed, timeout), workers, progress):
            name = record["name"]
            write_record(out, record)
            _plot_path(out, name).unlink(missing_ok=True)
            records[name] = record
            _plot(out, record)
            write_results(out, _all_records(out, registry, seed), seed)
    for case in chosen:
        _plot(out, records[case.name])
    write_results(out, _all_records(out, registry, seed), seed)
    ran = tuple(case.name for case in missing)
    return PhysicsCheck(out, tuple(records[case.name] for case in chosen), ran)


def _is_held(record: "Mapping[str, Any] | None", case: "Case", seed: int) -> bool:
    return record is not None and is_finished(record, case_identity(case, seed))


class _Setting(NamedTuple):
    """What all cases of a check share: see `check_physics`."""

    seed: int
    timeout: float | None


def _run_all(
    missing: "Sequence[Case]", setting: _Setting, workers: "Executor | None", progress: bool
) -> Iterator[dict[str, Any]]:
    """Records of cases as they finish."""
    if workers is None:
        for number, case in enumerate(missing, 1):
            label = f"{case.name} ({number} of {len(missing)})"
            with fraction_bar(label, shown=progress) as tell:
                yield run_case(case, setting.seed, setting.timeout, tell)
        return
    futures = {_submitted(workers, case, setting): case for case in missing}
    with progress_bar("validation cases", len(missing), shown=progress) as advance:
        for future in as_completed(futures):
            yield _received(future, futures[future], setting.seed)
            advance(1)


def _submitted(workers: Executor, case: "Case", setting: _Setting) -> "Future[dict[str, Any]]":
    try:
        return workers.submit(run_case, case, *setting)
    except Exception as err:  # of a pool that another case has broken
        failed: Future[dict[str, Any]] = Future()
        failed.set_exception(err)
        return failed


def _received(future: "Future[dict[str, Any]]", case: "Case", seed: int) -> dict[str, Any]:
    """The record of a case; of one that its worker lost, a failed record."""
    try:
        return future.result()
    except Exception as err:  # the records of the other cases are still worth keeping
        return _failed(case, err, seed, 0.0)


def _chosen(names: Iterable[str], registry: "Mapping[str, Case]") -> "list[Case]":
    wanted = list(dict.fromkeys(names))
    for name in wanted:
        if name not in registry:
            raise InputError(
                f"no case {name!r}",
                where=Argument("names"),
                fix=f"choose from {', '.join(registry)}",
            )
    return [registry[name] for name in wanted or registry]


def run_case(
    case: "Case",
    seed: int,
    timeout: float | None = None,
    tell: Callable[[float], None] = lambda fraction: None,
) -> dict[str, Any]:
    """The record of one case, which ran or failed.

    Args:
        case: What to run.
        seed: Seed of its initial packings.
        timeout: Seconds that it may take; None sets no limit.
        tell: Called with the fraction that is done.
    """
    from ..models import time_limit

    began = time.perf_counter()
    try:
        with nullcontext() if timeout is None else time_limit(timeout):
            result = case.run(tell, seed)
        return finished_record(case, result, seed, time.perf_counter() - began)
    except Exception as err:  # whatever it is, the other cases are still worth running
        record = _failed(case, err, seed, time.perf_counter() - began)
        return record | {"traceback": traceback.format_exc()}


def _failed(case: "Case", err: Exception, seed: int, seconds: float) -> dict[str, Any]:
    said = " ".join(str(err).split())
    return failed_record(case, f"{type(err).__name__}: {said}", seed, seconds)


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
