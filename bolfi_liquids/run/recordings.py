"""A run's own copies of its recordings, so that it can be criticised wherever it was moved."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import existing_file, write_whole
from ..inputs.open import read_fields
from ..inputs.recording import Recording, as_recording

RECORDINGS_FOLDER = "recordings"
MAX_LETTERS = 60  # of a name, each of at most four bytes


def keep_recordings(run: Path, recordings: tuple[Recording, ...]) -> None:
    """Copy the files, byte for byte, numbered in their order."""
    folder = run / RECORDINGS_FOLDER
    folder.mkdir(exist_ok=True)
    for number, recording in enumerate(recordings, start=1):
        copy = folder / _name(number, recording.path.name)
        if not copy.exists() or hashlib.sha256(copy.read_bytes()).hexdigest() != recording.hash:
            content = recording.path.read_bytes()
            write_whole(copy, lambda path, content=content: path.write_bytes(content))


def kept_recordings(run: Path, record: Mapping[str, Any]) -> list[Recording]:
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
        path = existing_file(run / RECORDINGS_FOLDER / _name(number, name))
        content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() != digest:
            raise InputError(
                "is not the recording that this run was calibrated on",
                where=str(path),
                fix="put the original back, or calibrate again",
            )
        # with these bytes it has been checked
        opened.append(as_recording(read_fields(content, path), path, content))
    return opened


def kept_paths(run: Path, record: Mapping[str, Any]) -> tuple[Path, ...]:
    """Paths of the existing copies."""
    names = enumerate(record.get("files", {}).get("recordings", ()), start=1)
    paths = [run / RECORDINGS_FOLDER / _name(number, name) for number, name in names]
    return tuple(path for path in paths if path.is_file())


def _name(number: int, name: str) -> str:
    """Of a copy: the end of a long name, so that the copy's fits into the 255 bytes of a file's."""
    return f"{number}-{name[-MAX_LETTERS:]}"
