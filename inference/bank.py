"""Every finished simulation, kept on disk and reused."""

import json
import sqlite3
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

APPLICATION_ID = 0x424C4651  # marks the file; "BLFQ"
BUSY_MS = 60_000  # wait this long for another process's write
SCHEMA = """
CREATE TABLE IF NOT EXISTS simulation (
    identity TEXT NOT NULL,
    theta    TEXT NOT NULL,
    seed     INTEGER NOT NULL,
    signal   BLOB,
    dtype    TEXT,
    shape    TEXT,
    error    TEXT,
    seconds  REAL NOT NULL,
    created  REAL NOT NULL,
    PRIMARY KEY (identity, theta, seed)
)
"""


class Simulation(NamedTuple):
    """One finished run; `signal` is None where `error` says why it failed."""

    signal: np.ndarray | None
    error: str | None
    seconds: float


class SimulationBank:
    """Finished simulations by simulator identity, theta and seed, in one SQLite file.

    What was simulated depends on no observation, so runs and observations may share a bank,
    also at the same time: a write is one committed transaction in WAL mode.

    Args:
        path: File, created if missing; ":memory:" keeps nothing.

    Raises:
        ValueError: the file exists and is not a simulation bank.
    """

    def __init__(self, path: str | Path = ":memory:"):
        self.path = str(path)
        # one connection for all threads of the process, guarded by a lock
        self._lock = threading.Lock()
        self._connection = sqlite3.connect(
            self.path, timeout=BUSY_MS / 1000, isolation_level=None, check_same_thread=False
        )
        try:
            self._open()
        except sqlite3.DatabaseError as error:
            self._connection.close()
            if isinstance(error, sqlite3.OperationalError):
                raise
            raise ValueError(
                f"{self.path} is not a simulation bank; choose another file"
            ) from error
        except ValueError:
            self._connection.close()
            raise

    def _open(self) -> None:
        execute = self._connection.execute
        execute("BEGIN IMMEDIATE")  # two processes may create the file together
        application = execute("PRAGMA application_id").fetchone()[0]
        tables = execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if application != APPLICATION_ID and tables:
            raise ValueError(
                f"{self.path} is an SQLite file but not a simulation bank; choose another file"
            )
        execute(f"PRAGMA application_id = {APPLICATION_ID}")
        execute(SCHEMA)
        execute("COMMIT")
        execute("PRAGMA journal_mode = WAL")

    def get(self, identity: str, theta: Mapping[str, float], seed: int) -> Simulation | None:
        """The run of exactly this simulator, theta and seed, or None."""
        with self._lock:
            row = self._connection.execute(
                "SELECT signal, dtype, shape, error, seconds FROM simulation "
                "WHERE identity = ? AND theta = ? AND seed = ?",
                (identity, theta_key(theta), int(seed)),
            ).fetchone()
        if row is None:
            return None
        blob, dtype, shape, error, seconds = row
        if blob is None:
            return Simulation(None, error, seconds)
        signal = np.frombuffer(blob, np.dtype(dtype)).reshape(json.loads(shape)).copy()
        return Simulation(signal, error, seconds)

    def put(
        self, identity: str, theta: Mapping[str, float], seed: int, simulation: Simulation
    ) -> None:
        """Store a run; on return it survives the death of the process.

        A signal that is already there is kept, for whoever looked it up may have used it; an
        error gives way to whatever came of trying again.
        """
        blob, dtype, shape = None, None, None
        if simulation.signal is not None:
            signal = np.ascontiguousarray(simulation.signal)
            blob, dtype, shape = signal.tobytes(), signal.dtype.str, json.dumps(signal.shape)
        row = (
            *(identity, theta_key(theta), int(seed), blob, dtype, shape),
            *(simulation.error, simulation.seconds, time.time()),
        )
        with self._lock:
            self._connection.execute(
                "INSERT INTO simulation VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) "
                "ON CONFLICT DO UPDATE SET signal = excluded.signal, dtype = excluded.dtype, "
                "shape = excluded.shape, error = excluded.error, seconds = excluded.seconds, "
                "created = excluded.created WHERE simulation.signal IS NULL",
                row,
            )

    def __len__(self) -> int:
        with self._lock:
            return self._connection.execute("SELECT count(*) FROM simulation").fetchone()[0]

    def close(self) -> None:
        self._connection.close()

    def __enter__(self) -> "SimulationBank":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def theta_key(theta: Mapping[str, float]) -> str:
    """Canonical text of theta; `repr` of a float64 round-trips exactly."""
    return json.dumps({name: float(theta[name]) for name in sorted(theta)})
