"""A run's own copies of its recordings, so that it can be criticised wherever it was moved."""

import hashlib
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import existing_file, write_whole
from ..inputs.open import read_recording
from ..inputs.recording import Recording

RECORDINGS_FOLDER = "recordings"


def keep_recordings(run: Path, recordings: tuple[Recording, ...]) -> None:
    """Copy the files, byte for byte, numbered in their order."""
    folder = run / RECORDINGS_FOLDER
    folder.mkdir(exist_ok=True)
    for number, recording in enumerate(recordings, start=1):
        copy = folder / _name(number, recording.path.name)
        if not copy.exists():
            content = recording.path.read_bytes()
            write_whole(copy, lambda path, content=content: path.write_bytes(content))


def kept_recordings(run: Path, record: dict[str, Any]) -> list[Recording]:
    """The recordings that a run was calibrated on.

    Args:
        run: The RUN directory.
        record: Its run.toml.

    Raises:
        InputError: A copy is missing, or is not the recording that was calibrated on.
    """
    opened = []
    names, hashes = record["files"]["recordings"], record["inputs"]["sha256"]
    for number, (name, digest) in enumerate(zip(names, hashes, strict=True), start=1):
        path = run / RECORDINGS_FOLDER / _name(number, name)
        if hashlib.sha256(existing_file(path).read_bytes()).hexdigest() != digest:
            raise InputError(
                "is not the recording that this run was calibrated on",
                where=str(path),
                fix="put the original back, or calibrate again",
            )
        opened.append(read_recording(path))  # with these bytes it has been checked
    return opened


def _name(number: int, name: str) -> str:
    return f"{number}-{name}"
