"""`check physics`: the fluid against analytic solutions and measurements."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Argument, InputError
from ..inputs.settings import checked_seed
from .case_files import CaseFiles, results_folder
from .case_runner import Setting, run_unfinished
from .physics_records import CASES, RESULTS, write_results

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
    """Every case, by name: first `cases` of whole stirs, then `cup_cases`, of the liquid of stirs,
    and `wet_cases`, of that of pours."""
    from ..models.validation import cases, cup_cases, discover, wet_cases

    return discover(cases, cup_cases, wet_cases)


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
    setting = Setting(checked_seed(seed), timeout, executor, progress)
    out = results_folder(out)
    files = CaseFiles(out / CASES, out)
    files.make()

    def keep() -> None:
        held = files.of_today(registry.values(), setting.seed)
        write_results(out, held, setting.seed)

    return PhysicsCheck(out, *run_unfinished(chosen, files, setting, keep))


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
