"""What `check physics` keeps of its cases: a record of each, and all results in one file.

OUT/cases/NAME.json is written whole when its case has finished, so that a killed check repeats
no finished case, and two checks may run different cases side by side. OUT/physics.json is made
from these. A record is used again for the same seed, tolerance, settings and code of the case,
version of the simulator and version of the package.
"""

import json
import math
import sys
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..files import write_text
from ..run.provenance import versions

if TYPE_CHECKING:
    from ..models.validation import Case, CaseResult, Row

CASES = "cases"
RESULTS = "physics.json"
LIBRARIES = ("bolfi-liquids", "numpy", "scipy", "taichi")


def case_identity(case: "Case", seed: int) -> dict[str, Any]:
    """What a finished record must agree with to be used again."""
    from ..models import MODEL_VERSION

    return {
        "seed": seed,
        "model": MODEL_VERSION,
        "version": versions(("bolfi-liquids",))["bolfi-liquids"],
        "tolerance": case.tolerance,
        "settings": plain(case.settings),
        "code": _code(case),
    }


def _code(case: "Case") -> str:
    """SHA-256 of the case's module and of all that cases share.

    Rows may have tolerances of their own, which nothing but the code tells.
    """
    module = sys.modules.get(case.run.__module__)
    own = getattr(module, "__file__", None)  # a notebook has none
    return sha256(_shared_code() + (Path(own).read_bytes() if own else b"")).hexdigest()


@cache
def _shared_code() -> bytes:
    """Sources of the models' validation, without the modules of single cases."""
    from ..models import validation

    folder = Path(validation.__path__[0])
    shared = [
        path
        for path in sorted(folder.rglob("*.py"))
        if not path.parent.name.endswith("cases") or path.name.startswith("_")
    ]
    return b"".join(path.read_bytes() for path in shared)


def has_identity(record: Mapping[str, Any], identity: Mapping[str, Any]) -> bool:
    """Whether the record has all of an identity, see `case_identity`."""
    return all(record.get(field) == value for field, value in identity.items())


def finished_record(
    case: "Case", result: "CaseResult", seed: int, seconds: float
) -> dict[str, Any]:
    """A case that ran to its end, within its tolerances or not."""
    panels = [
        {"x_label": p.x_label, "y_label": p.y_label, "log": p.log}
        | {"curves": [dict(c._asdict()) for c in p.curves]}
        for p in result.panels
    ]
    record = _about(case, seed) | {
        "passed": result.passed,
        "error": None,
        "seconds": round(seconds, 3),
        "rows": [row_record(row) for row in result.rows],
        "notes": dict(result.notes),
        "panels": panels,
    }
    return plain(record)


def row_record(row: "Row") -> dict[str, Any]:
    """One number compared with its truth, and whether it is within its tolerance."""
    return row._asdict() | {"passed": row.passed}


def failed_record(case: "Case", error: str, seed: int, seconds: float) -> dict[str, Any]:
    """A case that raised; it is tried again by the next check."""
    outcome = {"passed": False, "error": error, "seconds": round(seconds, 3)}
    return _about(case, seed) | outcome | {"rows": [], "notes": {}, "panels": []}


def is_finished(record: Mapping[str, Any], identity: Mapping[str, Any]) -> bool:
    """Whether the record is of a case that ran to its end and has the same identity."""
    return record.get("error") is None and has_identity(record, identity)


def write_results(out: Path, records: Iterable[Mapping[str, Any]], seed: int) -> Path:
    """All records in one file, without the points of their plots; its path."""
    cases = without_panels(records)
    passed = all(record["passed"] for record in cases.values())
    results = {**made_with(seed), "passed": passed, "cases": cases}
    return write_text(out / RESULTS, json.dumps(results, indent=2, allow_nan=False) + "\n")


def without_panels(records: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Records by name, without the points of their plots."""
    return {
        record["name"]: {key: value for key, value in record.items() if key != "panels"}
        for record in records
    }


def made_with(seed: int) -> dict[str, Any]:
    """When, and by which versions and seed, results were made."""
    from ..models import MODEL_VERSION

    return {
        "created": _now(),
        "version": versions(LIBRARIES)["bolfi-liquids"],
        "model": MODEL_VERSION,
        "seed": seed,
        "versions": versions(LIBRARIES),
    }


def _about(case: "Case", seed: int) -> dict[str, Any]:
    return {
        "name": case.name,
        "title": case.title,
        "truth": case.truth,
        "source": case.source,
        "unit": case.unit,
        **case_identity(case, seed),
        "created": _now(),
    }


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def plain(value: Any) -> Any:
    """Numbers and arrays as JSON gives them back.

    Returns:
        Lists for arrays and tuples, None for what is not finite.

    Raises:
        TypeError: something else than numbers, text, and mappings and sequences of them.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if not isinstance(value, str | int | float | None):
        raise TypeError(f"a case's settings and notes must be numbers and text, got {value!r}")
    return None if isinstance(value, float) and not math.isfinite(value) else value
