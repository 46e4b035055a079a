"""Running a pipeline many times on data whose truth is known; every replicate is kept on disk."""

import io
import json
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import Executor, as_completed
from contextlib import ExitStack, closing
from os.path import commonprefix
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import (
    check_callable,
    check_flag,
    check_function,
    check_identity,
    check_progress,
    check_text,
    check_timeout,
    checked_integer,
)
from ..describe import describe
from ..prior import Prior, checked_prior
from ..progress import progress_bar
from ..simulations.compute import Workers, open_executor
from ..simulations.database import disk_errors, opened_database
from ..simulations.failures import failure_columns, failure_of, is_unusable
from ..simulations.job import BATCH
from ..types import Simulator
from .finished_replicates import Replicates
from .one_replicate import Observe, Pipeline, Replicate, ReplicatePlan, run_replicate

MOST_SHOWN = 40  # letters of a setting in a message
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
ARRAYS = ("truth", "observed", "draws", "log_density")

BLOCK = 256  # truths are made in blocks of one shape, so that JAX seldom compiles


def replicates(  # noqa: PLR0913  one flat place for what defines a check
    pipeline: Pipeline,
    simulate: Simulator | None = None,
    prior: Prior | None = None,
    n: int = 256,
    *,
    seed: int = 0,
    draws: int = 63,
    independent: bool = False,
    observe: Observe | None = None,
    executor: Workers | None = None,
    store: str | Path = ":memory:",
    identity: str = "",
    timeout: float | None = None,
    retry: bool = False,
    progress: bool | Callable[[int], object] = True,
) -> Replicates:
    """Draw parameters from the prior, simulate data, run the pipeline on them; n times.

    Over such replicates the truth is one more draw of the right posterior, which `sbc`,
    `coverage` and `tarp` test in different ways; all three can use one set of replicates.

    Args:
        pipeline: Callable (observed, seed) -> draws, see `Pipeline`; for example a
            `FitPipeline`. Picklable where the executor uses processes.
        simulate: Makes the data, see `fit`; None takes the pipeline's own `simulate`.
        prior: Of the truths; None takes the pipeline's own `prior`.
        n: Replicates. More can be added to a store later.
        seed: Fixes truths, data and the pipeline's seeds.
        draws: L, kept of each replicate once thinned to near independence by its effective
            sample size, which must be about 2 L. Choose 2^k - 1: bins then divide L + 1.
        independent: The pipeline's draws are independent: do not thin by autocorrelation.
        observe: Callable (signal, rng) -> observed that adds measurement noise; None adds none.
        executor: Runs each replicate as a call of its own, see `fit`; None runs them here, one
            by one. Processes must be spawned, not forked, since JAX runs threads.
        store: File that keeps every finished replicate. The same call on the same file goes
            on where the last one ended, also after a crash.
        identity: Names what the store cannot see, and needs: anything in the code that would
            change the draws must change it.
        timeout: Seconds that simulating the data of one replicate may take; one that takes longer
            has failed. What a pipeline simulates itself has a limit of its own, such as
            `FitPipeline(..., options={"timeout": 60})`.
        retry: Run again what failed before and is in the store with its error.
        progress: Whether to show a bar on stderr; or a function that is called with 1 for each
            replicate.

    Raises:
        ValueError: bad argument; a store made with other settings; a pipeline that returns
            something of the wrong form, or a simulator that does so in all of the first
            replicates of a store. Replicates of which it does so are not kept.

    Example:
        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids import inference
        >>> prior = inference.Prior({"mean": dist.Normal(0, 1)})
        >>> def simulate(theta, seeds):  # four values of sd 1
        ...     return np.stack([np.random.default_rng(seed).normal(mean, 1, 4)
        ...                      for mean, seed in zip(theta["mean"], seeds)])
        >>> def posterior(observed, seed):  # in closed form
        ...     normal = np.random.default_rng(seed).normal
        ...     return {"mean": normal(observed.sum() / 5, 0.2**0.5, 100)}
        >>> runs = inference.replicates(posterior, simulate, prior, n=200, independent=True)
        >>> inference.sbc(runs).ok
        True
    """
    check_function("pipeline", pipeline)
    simulator = _own(pipeline, "simulate", simulate)
    prior = checked_prior(_own(pipeline, "prior", prior))
    check_function("simulate", simulator)
    check_callable("observe", observe)
    check_timeout(timeout)
    check_progress(progress)
    check_text("identity", identity)
    if isinstance(store, str | Path):
        check_identity(identity, "store", store)
    check_flag("independent", independent)
    check_flag("retry", retry)
    n, seed = checked_integer("n", n), checked_integer("seed", seed, 0)
    draws = checked_integer("draws", draws)
    plan = ReplicatePlan(
        pipeline, simulator, observe, prior.names, seed, draws, independent, timeout
    )
    settings = _settings(plan, prior) | {"identity": identity}
    truths = _truths(prior, n, seed)
    with ExitStack() as stack:
        workers = stack.enter_context(open_executor(executor))
        kept = stack.enter_context(closing(ReplicateStore(store, settings)))
        done = {
            number: replicate
            for number, replicate in kept.load().items()
            if number < n and not (retry and replicate.error)
        }
        advance = stack.enter_context(progress_bar("replicates", n, shown=progress, done=len(done)))
        missing = [number for number in range(n) if number not in done]
        with closing(_run(plan, missing, truths, workers)) as made:
            unusable = 0
            for replicate in made:
                done[replicate.number] = replicate
                if not is_unusable(replicate.error):
                    kept.put(replicate)
                else:  # the next call tries it again
                    unusable += 1
                    if unusable == len(done) == BATCH:  # all would fail in the same way
                        raise ValueError(f"{replicate.stage}: {replicate.error.text}")
                advance(1)
    ordered = [done[number] for number in range(n)]
    finished = tuple(r for r in ordered if r.error is None)
    return Replicates(prior, seed, draws, finished, tuple(r for r in ordered if r.error))


def _settings(plan: ReplicatePlan, prior: Prior) -> dict[str, str]:
    """All that a replicate's draws depend on, as text."""
    given = plan._asdict()
    del given["timeout"]
    return {name: describe(value) for name, value in {**given, "prior": prior}.items()}


def _truths(prior: Prior, n: int, seed: int) -> np.ndarray:
    """Draws of the prior [n, d]; the first ones do not depend on n."""
    rows = BLOCK * -(-n // BLOCK)
    u = np.random.default_rng(seed).random((rows, len(prior)))
    return prior.to_array(prior.from_unit(u))[:n]


def _own(pipeline: Pipeline, name: str, given: Any) -> Any:
    found = getattr(pipeline, name, None) if given is None else given
    if found is None:
        raise ValueError(f"{name} is needed, for the pipeline has none of its own")
    return found


def _run(
    plan: ReplicatePlan, numbers: list[int], truths: np.ndarray, executor: Executor | None
) -> Generator[Replicate, None, None]:
    """Replicates as they finish."""
    if executor is None:
        yield from (run_replicate(plan, number, truths[number]) for number in numbers)
        return
    futures = [executor.submit(run_replicate, plan, number, truths[number]) for number in numbers]
    try:
        for future in as_completed(futures):
            yield future.result()
    finally:
        for future in futures:
            future.cancel()  # after a mistake or Ctrl-C there is no use in the rest


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
        execute = self._connection.execute
        with ExitStack() as undo, disk_errors(path):
            undo.callback(self.close)
            execute("BEGIN IMMEDIATE")  # two processes may begin together
            stored = dict(execute("SELECT name, value FROM settings").fetchall())
            if not stored:
                self._connection.executemany("INSERT INTO settings VALUES (?, ?)", settings.items())
            execute("COMMIT")
            both = {name: (stored.get(name), settings.get(name)) for name in {*stored, *settings}}
            unlike = [
                "{}: stored {}, now {}".format(name, *_where_unlike(one, other))
                for name, (one, other) in sorted(both.items())
                if stored and one != other
            ]
            if unlike:
                raise ValueError(
                    f"{path} holds replicates made with other settings ({'; '.join(unlike)}); "
                    "restore these, or choose another file"
                )
            undo.pop_all()

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
        # SQLite takes NaN for NULL
        kept = (replicate.number, file.getvalue(), replicate.effective, replicate.seconds)
        row = (*kept, replicate.stage, *failure_columns(replicate.error))
        with disk_errors(self.path):
            self._connection.execute(
                "INSERT INTO replicate VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET "
                "(arrays, effective, seconds, stage, failure, error) = (excluded.arrays, "
                "excluded.effective, excluded.seconds, excluded.stage, excluded.failure, "
                "excluded.error) WHERE error IS NOT NULL",
                row,
            )

    def close(self) -> None:
        self._connection.close()


def _from_row(row: tuple) -> Replicate:
    """The replicate of a row's columns, in the order of `load`."""
    number, arrays, effective, seconds, stage, kind, text = row
    with np.load(io.BytesIO(arrays), allow_pickle=False) as file:
        held = {"log_density": None, **file}
    size = np.nan if effective is None else effective
    how = {"effective": size, "seconds": seconds, "stage": stage, "error": failure_of(kind, text)}
    return Replicate(number, **how, **held)


def _where_unlike(one: str | None, other: str | None) -> list[str]:
    """Two settings as a message shows them, cut around the first letter in which they differ:
    representations of pipelines fill pages."""
    texts = [json.dumps(one), json.dumps(other)]
    first = max(len(commonprefix(texts)) - MOST_SHOWN // 2, 0)
    last = first + MOST_SHOWN
    return [
        f"{'...' if first else ''}{text[first:last]}{'...' if text[last:] else ''}"
        for text in texts
    ]
