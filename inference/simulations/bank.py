"""Every finished simulation, kept on disk and reused."""

import json
import logging
import sqlite3
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..arguments import LARGEST_INT64, check_kind, check_text, checked_integer
from ..notebook_display import Displayed
from .database import disk_errors, opened_database
from .failures import Failure, failure_columns, failure_of
from .simulation_locks import Claims

logger = logging.getLogger(__name__)

SCHEMA = """
CREATE TABLE IF NOT EXISTS simulation (
    identity TEXT NOT NULL,
    theta    TEXT NOT NULL,
    seed     INTEGER NOT NULL,
    signal   BLOB,
    dtype    TEXT,
    shape    TEXT,
    failure  TEXT,
    error    TEXT,
    seconds  REAL NOT NULL,
    created  REAL NOT NULL,
    digest   BLOB NOT NULL,
    PRIMARY KEY (identity, theta, seed)
);
"""


class Simulation(NamedTuple):
    """One finished run; `signal` is None where `error` says why it failed."""

    signal: np.ndarray | None
    error: Failure | None
    seconds: float


class Simulations(NamedTuple):
    """n finished simulations, as `Bolfi.tell` takes them."""

    theta: dict[str, np.ndarray]  # name -> [n]
    signals: np.ndarray  # [n, *signal_shape]
    seeds: np.ndarray  # int64 [n]


class SimulationBank(Displayed):
    """Finished simulations by simulator identity, theta and seed, in one SQLite file.

    What was simulated depends on no observation, so runs and observations may share a bank,
    also at the same time: a write is one committed transaction in WAL mode, and a claim keeps the
    other threads and processes of a machine from simulating the same job. Claims are locks on the
    file `<path>-claims`, which remains, empty. Each row holds a digest of itself; damaged rows are
    logged and simulated again.

    Args:
        path: File, created if missing; ":memory:" keeps nothing.

    Raises:
        ValueError: the file is not a simulation bank, or cannot be read and written.

    Example:
        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids import inference
        >>> prior = inference.Prior({"decay": dist.LogUniform(0.1, 10)})
        >>> time = np.linspace(0, 5, 50)
        >>> def simulate(theta, seed):
        ...     noise = np.random.default_rng(seed).normal(0, 0.05, time.size)
        ...     return np.exp(-theta["decay"] * time) + noise
        >>> observed = simulate({"decay": 2.0}, 123)
        >>> with inference.SimulationBank() as bank:  # SimulationBank("runs.sqlite") keeps them
        ...     fit = inference.fit(simulate, prior, observed, budget=12, noise=0, vectorised=False,
        ...                         bank=bank, identity="decay")
        ...     theta, signals, seeds = bank.simulations("decay")
        >>> signals.shape
        (15, 50)
    """

    def __init__(self, path: str | Path = ":memory:"):
        self.path = str(path)
        # one connection for all threads of the process, guarded by a lock
        self._lock = threading.Lock()
        self._connection = opened_database(path, SCHEMA, "simulation bank")
        self._resources = ExitStack()
        self._resources.callback(self._connection.close)
        self._claims = Claims.share(None if self.in_memory else f"{self.path}-claims")
        self._resources.callback(self._claims.close)

    @property
    def in_memory(self) -> bool:
        """Whether everything is forgotten when the bank is closed."""
        return self.path == ":memory:"

    @property
    def where(self) -> str:
        """A sentence for messages: where finished simulations are kept."""
        if self.in_memory:
            return "Finished simulations are not kept, because the bank is in memory"
        return f"Finished simulations are kept in {self.path}"

    def _shown(self) -> list[tuple[str, str]]:
        count = "SELECT identity, count(*), count(signal) FROM simulation GROUP BY identity"
        try:
            found = self._execute(count)
        except sqlite3.ProgrammingError:
            return [("file", self.path), ("state", "closed")]
        of_each = [
            (f"identity {identity!r:.60}", f"{count} simulations, {count - good} failed")
            for identity, count, good in found
        ]
        return [("file", self.path), *(of_each or [("simulations", "none")])]

    def _execute(self, statement: str, *values: object) -> list[tuple[Any, ...]]:
        with self._lock:
            return self._connection.execute(statement, values).fetchall()

    def _rows(self, where: str, *values: object) -> list[tuple[Any, ...]]:
        """Rows as `_digest` takes them, and behind each its digest; by theta and seed."""
        return self._execute(
            "SELECT identity, theta, seed, signal, dtype, shape, failure, error, seconds, digest "
            f"FROM simulation WHERE {where} ORDER BY theta, seed",
            *values,
        )

    def _is_whole(self, row: Sequence[Any], digest: bytes) -> bool:
        """Whether a row, see `_digest`, is as it was stored; one that is not is logged."""
        if _digest(row) == digest:
            return True
        logger.warning("%s: a damaged row counts as not simulated: %s", self.path, row[1:3])
        return False

    def get(self, identity: str, theta: Mapping[str, float], seed: int) -> Simulation | None:
        """The run of exactly this simulator, theta and seed, or None."""
        key = _key(identity, theta, seed)
        rows = self._rows("identity = ? AND theta = ? AND seed = ?", *key)
        if not rows:
            return None
        *row, digest = rows[0]
        if not self._is_whole(row, digest):
            with disk_errors(self.path):  # else it could not be put again
                self._execute("DELETE FROM simulation WHERE digest = ?", digest)
            return None
        blob, dtype, shape, kind, text, seconds = row[3:]
        signal = None if blob is None else _signal(blob, dtype, shape)
        return Simulation(signal, failure_of(kind, text), seconds)

    def put(
        self, identity: str, theta: Mapping[str, float], seed: int, simulation: Simulation
    ) -> None:
        """Store a run; on return it survives the death of the process.

        A signal that is already there is kept, for whoever looked it up may have used it; an
        error gives way to whatever came of trying again.

        Raises:
            OSError: the disk is full or fails; what is in the bank is kept.
        """
        check_kind("simulation", simulation, Simulation)
        blob, dtype, shape = None, None, None
        if simulation.signal is not None:
            signal = np.ascontiguousarray(simulation.signal)
            blob, dtype, shape = signal.tobytes(), signal.dtype.str, json.dumps(signal.shape)
        why, seconds = failure_columns(simulation.error), float(simulation.seconds)
        row = (*_key(identity, theta, seed), blob, dtype, shape, *why, seconds)
        with disk_errors(self.path):
            self._execute(
                "INSERT INTO simulation VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) "
                "ON CONFLICT DO UPDATE SET signal = excluded.signal, dtype = excluded.dtype, "
                "shape = excluded.shape, failure = excluded.failure, error = excluded.error, "
                "seconds = excluded.seconds, created = excluded.created, digest = excluded.digest "
                "WHERE simulation.signal IS NULL",
                *row,
                time.time(),
                _digest(row),
            )

    def holds(self, identity: str) -> bool:
        """Whether there is a signal of this simulator."""
        check_text("identity", identity)
        known = "SELECT 1 FROM simulation WHERE identity = ? AND signal IS NOT NULL LIMIT 1"
        return bool(self._execute(known, identity))

    def simulations(self, identity: str) -> Simulations:
        """All signals of one simulator, those of NaN included, those that raised left out.

        They are ordered by theta and seed: in which order they were finished is chance, and
        what is learned from them must not depend on it.

        Raises:
            ValueError: there are none, or their signals or parameters are not alike.
        """
        check_text("identity", identity)
        found = self._rows("identity = ? AND signal IS NOT NULL", identity)
        rows = [row for *row, digest in found if self._is_whole(row, digest)]
        theta = [json.loads(row[1]) for row in rows]
        kinds = {(tuple(names), row[5]) for names, row in zip(theta, rows, strict=True)}
        shown = [f"{', '.join(names)} -> {shape}" for names, shape in sorted(kinds)]
        if len(kinds) != 1:
            raise ValueError(
                f"{self.path} must hold simulations of one kind for identity={identity!r}, got "
                f"{shown or 'none'}"
            )
        return Simulations(
            {name: np.array([row[name] for row in theta]) for name in theta[0]},
            np.stack([_signal(*row[3:6]) for row in rows]),
            np.array([row[2] for row in rows], np.int64),
        )

    def claim(self, identity: str, theta: Mapping[str, float], seed: int) -> bool:
        """Whether the caller may simulate this now; False while somebody else does.

        A claim lasts until `release`, or until the process ends. Look into the bank again after
        taking one: the last claimant may just have finished.
        """
        return self._claims.take(json.dumps(_key(identity, theta, seed)))

    def release(self, identity: str, theta: Mapping[str, float], seed: int) -> None:
        """End a claim; nothing happens if there is none."""
        self._claims.give_back(json.dumps(_key(identity, theta, seed)))

    def __len__(self) -> int:
        return self._execute("SELECT count(*) FROM simulation")[0][0]

    def close(self) -> None:
        """Close the file and end this bank's claims; closing twice does no harm."""
        with self._lock:  # another thread may be storing what it just finished
            self._resources.close()

    def __enter__(self) -> "SimulationBank":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _key(identity: str, theta: Mapping[str, float], seed: int) -> tuple[str, str, int]:
    """Identity, canonical text of theta (`repr` of a float64 round-trips exactly) and seed.

    Raises:
        ValueError: no text, no names and numbers, or no integer.
    """
    check_text("identity", identity)
    whole = checked_integer("seed", seed, -LARGEST_INT64 - 1, LARGEST_INT64)
    try:
        return identity, json.dumps({name: float(theta[name]) for name in sorted(theta)}), whole
    except (TypeError, ValueError, KeyError) as error:
        raise ValueError(f"theta must map names to numbers, got {theta!r:.100}") from error


def _digest(row: Sequence[Any]) -> bytes:
    """SHA-256 of identity, theta, seed, signal, dtype, shape, failure, error and seconds."""
    signal = row[3] or b""
    return sha256(repr((*row[:3], *row[4:])).encode() + signal).digest()


def _signal(blob: bytes, dtype: str, shape: str) -> np.ndarray:
    return np.frombuffer(blob, np.dtype(dtype)).reshape(json.loads(shape)).copy()
