"""summary.json: the numbers of a run, a section for each command."""

import json
import math
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import write_text

NAME = "summary.json"
RESTORE = "delete it; calibrate --resume, criticise and pour write it again from what was simulated"


def read_summary(run: Path) -> dict[str, Any]:
    """All sections written so far; empty where there is no file yet.

    Raises:
        InputError: The file is not JSON.
    """
    path = run / NAME
    if not path.exists():
        return {}
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as err:
        raise InputError(f"not JSON (line {err.lineno})", where=str(path), fix=RESTORE) from err
    if not isinstance(summary, dict) or not all(isinstance(s, dict) for s in summary.values()):
        raise InputError("holds no sections", where=str(path), fix=RESTORE)
    return summary


def write_section(run: Path, name: str, section: dict[str, Any]) -> None:
    """Replace one section and leave the others as they are; the file is never half written."""
    summary = read_summary(run) | {name: _finite(section)}
    write_text(run / NAME, json.dumps(summary, indent=2, allow_nan=False) + "\n")


def _finite(value):
    """JSON has no NaN: what could not be computed (R-hat of one chain) becomes null."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
