"""Every finished replicate, kept on disk, so that a check that died goes on."""

import io
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..simulations.database import disk_errors, opened_database
from ..simulations.failures import failure_columns, failure_of
from .one_replicate import Replicate

SCHEMA = """
CREATE TABLE IF NOT EXISTS settings (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS replicate (
    number    INTEGER PRIMARY KEY,
    arrays    BLOB NOT NULL,
    effective REAL,
    seconds   REAL NOT NULL,
    stage     TEXT,
    failure   TEXT,
    error     TEXT
);
"""
MOST_SHOWN = 40  # letters of a setting in a message
ARRAYS = ("truth", "observed", "draws", "log_density")


class ReplicateStore:
    """Replicates of one pipeline under one set of settings, in one SQLite file.

    A write is one committed transaction in WAL mode: what `put` has returned from survives
    the death of the process.

    Args:
        path: File, created if missing; ":memory:" keeps nothing.
        settings: All that a replicate depends on, as text. A file keeps the settings of its
            first use.

    Raises:
        ValueError: the file is no such store, holds replicates made with other settings, or
            cannot be read and written.
    """

    def __init__(self, path: str | Path, settings: Mapping[str, str]):
        self.path = str(path)
        self._connection = opened_database(path, SCHEMA, "replicate store")
        try:
            with disk_errors(path):
                self._agree_on(dict(settings))
        except BaseException:
            self._connection.close()
            raise

    def _agree_on(self, settings: dict[str, str]) -> None:
        execute = self._connection.execute
        execute("BEGIN IMMEDIATE")  # two processes may begin together
        stored = dict(execute("SELECT name, value FROM settings").fetchall())
        if not stored:
            self._connection.executemany("INSERT INTO settings VALUES (?, ?)", settings.items())
        execute("COMMIT")
        if stored and stored != settings:
            raise ValueError(_difference(self.path, stored, settings))

    def load(self) -> dict[int, Replicate]:
        """All replicates kept, by number."""
        rows = self._connection.execute(
            "SELECT number, arrays, effective, seconds, stage, failure, error FROM replicate "
            "ORDER BY number"
        )
        return {row[0]: _from_row(row) for row in rows}

    def put(self, replicate: Replicate) -> None:
        """Keep a replicate; a finished one is never replaced, a failed one is."""
        held = {name: getattr(replicate, name) for name in ARRAYS}
        file = io.BytesIO()
        np.savez_compressed(file, **{k: v for k, v in held.items() if v is not None})
        effective = None if np.isnan(replicate.effective) else replicate.effective
        kept = (replicate.number, file.getvalue(), effective, replicate.seconds)
        row = (*kept, replicate.stage, *failure_columns(replicate.error))
        with disk_errors(self.path):
            self._connection.execute(
                "INSERT INTO replicate VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET "
                "arrays = excluded.arrays, effective = excluded.effective, "
                "seconds = excluded.seconds, stage = excluded.stage, failure = excluded.failure, "
                "error = excluded.error WHERE error IS NOT NULL",
                row,
            )

    def close(self) -> None:
        self._connection.close()

    def __enter__(self) -> "ReplicateStore":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _from_row(row: tuple) -> Replicate:
    """The replicate of a row's columns, in the order of `load`."""
    number, arrays, effective, seconds, stage, kind, text = row
    with np.load(io.BytesIO(arrays), allow_pickle=False) as file:
        held = dict(file)
    held.setdefault("log_density", None)
    size = np.nan if effective is None else effective
    how = {"effective": size, "seconds": seconds, "stage": stage, "error": failure_of(kind, text)}
    return Replicate(number, **how, **held)


def _difference(path: str, stored: Mapping[str, str], settings: Mapping[str, str]) -> str:
    """Why a store is refused."""
    unlike = [
        f"{name}: stored {_start(stored.get(name))}, now {_start(settings.get(name))}"
        for name in sorted(set(stored) | set(settings))
        if stored.get(name) != settings.get(name)
    ]
    return (
        f"{path} holds replicates made with other settings "
        f"({'; '.join(unlike)}); restore these, or choose another file"
    )


def _start(value: str | None) -> str:
    """A setting as a message shows it: representations of pipelines fill pages."""
    text = json.dumps(value)
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}..."
