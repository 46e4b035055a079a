"""Where the records and plots of validation cases lie, each written whole when its case is over."""

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import Argument, InputError
from ..files import given_path, write_text
from ..numerals import load_json
from .physics_records import case_identity, has_identity

if TYPE_CHECKING:
    from ..models.validation import Case


class CaseFiles(NamedTuple):
    """Directories of records NAME.json and of plots NAME.svg."""

    records: Path
    plots: Path

    def make(self) -> None:
        """Make both directories if they are missing."""
        for folder in self:
            folder.mkdir(parents=True, exist_ok=True)

    def read(self, name: str) -> dict[str, Any] | None:
        """A case's record; None where there is none.

        Raises:
            InputError: the file is damaged.
        """
        path = self._record(name)
        if not path.exists():
            return None
        fix = "delete it to run it again"
        try:
            record = load_json(path.read_text(encoding="utf-8"))
        except (ValueError, RecursionError) as err:
            raise InputError(f"not JSON ({err})", where=str(path), fix=fix) from err
        if not isinstance(record, dict) or record.get("name") != name:
            raise InputError("not a case's record", where=str(path), fix=fix)
        return record

    def of_today(self, cases: "Iterable[Case]", seed: int) -> Iterator[dict[str, Any]]:
        """Records that these cases would have again, from this check or one before."""
        for case in cases:
            record = self.read(case.name)
            if record is not None and has_identity(record, case_identity(case, seed)):
                yield record

    def write(self, record: Mapping[str, Any]) -> None:
        """Keep a case's record, and draw its plot anew."""
        text = json.dumps(record, indent=1, allow_nan=False)
        write_text(self._record(record["name"]), text + "\n")
        self._plot(record["name"]).unlink(missing_ok=True)
        self.draw(record)

    def draw(self, record: Mapping[str, Any]) -> None:
        """Draw what is not drawn yet: a check may have died between the record and its plot."""
        path = self._plot(record["name"])
        if record["panels"] and not path.exists():
            from .physics_figure import physics_figure

            write_text(path, physics_figure(record))

    def _record(self, name: str) -> Path:
        return self.records / f"{name}.json"

    def _plot(self, name: str) -> Path:
        return self.plots / f"{name}.svg"


def results_folder(out: str | Path) -> Path:
    """`out`, which a person gave for the results of a check.

    Raises:
        InputError: It is no path, or is something else than a directory.
    """
    out = given_path(out, Argument("out"))
    if out.exists() and not out.is_dir():
        raise InputError("not a directory", where=str(out), fix="choose another `out`")
    return out
