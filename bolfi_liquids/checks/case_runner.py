"""Validation cases run in this process or in others; one that fails costs itself alone."""

import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any, NamedTuple

from ..progress import fraction_bar, progress_bar
from ..run.workers import open_workers
from .case_files import CaseFiles
from .physics_records import case_identity, failed_record, finished_record, is_finished

if TYPE_CHECKING:
    from ..inference.simulations import Workers
    from ..models.validation import Case


class Setting(NamedTuple):
    """What all cases of a check share: see `check_physics`."""

    seed: int
    timeout: float | None = None
    executor: "Workers | None" = None
    progress: bool = True


class Checked(NamedTuple):
    """Cases after a check.

    Attributes:
        records: Of each case, in order.
        ran: Names of those that ran now; the others had finished before.
    """

    records: tuple[dict[str, Any], ...]
    ran: tuple[str, ...]


def run_unfinished(
    cases: "Sequence[Case]", files: CaseFiles, setting: Setting, keep: Callable[[], object]
) -> Checked:
    """Run the cases that have no finished record of the same identity.

    Args:
        cases: In the order of the records returned.
        files: Where records are looked for, and kept as soon as a case is over.
        setting: Of all cases.
        keep: Called after each record, and at the end, to write what is made of all of them.

    Raises:
        InputError: A record is damaged, or the timeout is no positive number.
    """
    found = {case.name: files.read(case.name) for case in cases}
    records = {name: record for name, record in found.items() if record is not None}
    missing = [case for case in cases if not _is_held(records.get(case.name), case, setting.seed)]
    with open_workers(setting.executor, setting.timeout) as workers:
        for record in _run_all(missing, setting, workers):
            records[record["name"]] = record
            files.write(record)
            keep()
    for case in cases:
        files.draw(records[case.name])
    keep()
    return Checked(
        tuple(records[case.name] for case in cases), tuple(case.name for case in missing)
    )


def _is_held(record: Mapping[str, Any] | None, case: "Case", seed: int) -> bool:
    return record is not None and is_finished(record, case_identity(case, seed))


def _run_all(
    missing: "Sequence[Case]", setting: Setting, workers: Executor | None
) -> Iterator[dict[str, Any]]:
    """Records of cases as they finish."""
    if workers is None:
        for number, case in enumerate(missing, 1):
            label = f"{case.name} ({number} of {len(missing)})"
            with fraction_bar(label, shown=setting.progress) as tell:
                yield run_case(case, setting.seed, setting.timeout, tell)
        return
    futures = {_submitted(workers, case, setting): case for case in missing}
    with progress_bar("validation cases", len(missing), shown=setting.progress) as advance:
        for future in as_completed(futures):
            yield _received(future, futures[future], setting.seed)
            advance(1)


def _submitted(workers: Executor, case: "Case", setting: Setting) -> "Future[dict[str, Any]]":
    try:
        return workers.submit(run_case, case, setting.seed, setting.timeout)
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
