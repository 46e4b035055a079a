"""What every engine's runner shares: its orders, its data, its stopwatch, its rows of results.

Runs in each engine's own environment: NumPy, SciPy and Python 3.9 only.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tasks import TASKS, Reference, Task, score
from tasks.base import Theta

CHUNK = 4096  # points at which a density is evaluated at once


class Job(NamedTuple):
    """One run of one engine, at one or more budgets.

    Attributes:
        engine: Name in `compare.ENGINES`.
        kind: "posterior", or "steps" for the cost of single steps.
        task, seed, budgets, data: What to run: `data` names the data's seed.
        timed: Whether to time warm runs of ours, and NUTS.
        code: Digest of the code that decides the result.
        out: Directory of results and references.
        core: Processor to which this process is bound.
    """

    engine: str
    kind: str
    task: str
    seed: int
    budgets: tuple[int, ...]
    data: int
    timed: bool
    code: str
    out: str
    core: int


class Stopwatch:
    """A simulator that counts its own CPU seconds and runs.

    Attributes:
        seconds: CPU seconds spent in it.
        runs: Simulations made.
    """

    def __init__(self, simulate: Any):
        self._simulate = simulate
        self.seconds, self.runs = 0.0, 0

    def __call__(self, theta: Theta, seeds: np.ndarray) -> np.ndarray:
        started = time.process_time()
        signals = self._simulate(theta, seeds)
        self.seconds += time.process_time() - started
        self.runs += len(seeds)
        return signals


def receive(text: str) -> Job:
    """The job in `text`; binds this process to one processor, so that no library can use more."""
    job = Job(**json.loads(text))
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {job.core})
    return job


def results(out: str | Path) -> Path:
    """Where the rows of a comparison are."""
    return Path(out) / "results.jsonl"


def reference_path(out: str | Path, task: str, data: int) -> Path:
    """Where the data and the exact posterior of a task are."""
    return Path(out) / f"{task}-data{data}.npz"


def load(job: Job) -> tuple[Task, np.ndarray, Reference]:
    """The task, its data and the exact posterior."""
    with np.load(reference_path(job.out, job.task, job.data)) as stored:
        reference = Reference(stored["points"], stored["volume"], stored["mass"])
        return TASKS[job.task], stored["observed"], reference


def scores(log_density: Any, reference: Reference) -> dict[str, float]:
    """Scores of a density: callable, points [n, d] -> [n]. Always called with `CHUNK` points."""
    points = reference.points
    padded = np.concatenate([points, np.repeat(points[:1], -len(points) % CHUNK, axis=0)])
    parts = [log_density(part) for part in padded.reshape(-1, CHUNK, points.shape[1])]
    return score(np.concatenate(parts)[: len(points)], reference)._asdict()


def conclude(job: Job, row: dict[str, Any], reference: Reference, learn: Any) -> None:
    """Write a row with the scores of the density that `learn` returns, or with why there is none.

    `learn` puts into `row` what it measured: it is written in either case.
    """
    try:
        row.update(scores(learn(), reference))
    except Exception as error:  # noqa: BLE001  a peer may fail in any way, which is its result
        row["error"] = f"{type(error).__name__}: {error}"[:300]
    write(job, **row)


def write(job: Job, **values: object) -> None:
    """Append a row of results."""
    kept = ("engine", "kind", "task", "seed", "data", "code")
    row = {name: getattr(job, name) for name in kept}
    with results(job.out).open("a") as file:
        file.write(json.dumps({**row, **values}) + "\n")
