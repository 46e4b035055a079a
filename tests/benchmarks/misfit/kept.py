"""Results of a study, one line of JSON each."""

import json
import os
from pathlib import Path


def results(path: Path) -> list[dict]:
    """What was finished; a half-written last line is none."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_bytes()[: _whole(path)].splitlines()]


def keep(path: Path, result: dict) -> None:
    """Append a result."""
    if path.exists():  # or it would go on from half a line
        os.truncate(path, _whole(path))
    with path.open("a") as file:
        file.write(json.dumps(result) + "\n")


def _whole(path: Path) -> int:
    """Length of the file's finished lines."""
    return path.read_bytes().rfind(b"\n") + 1
