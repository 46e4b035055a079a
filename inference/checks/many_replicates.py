"""Running a pipeline many times on data whose truth is known."""

from collections.abc import Callable, Generator
from concurrent.futures import Executor, as_completed
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import (
    check_callable,
    check_flag,
    check_function,
    check_progress,
    check_text,
    check_timeout,
    checked_integer,
)
from ..describe import describe
from ..prior import Prior, checked_prior
from ..progress import progress_bar
from ..simulations.compute import Workers, open_executor
from ..simulations.failures import is_unusable
from ..simulations.job import BATCH
from ..types import Simulator
from .finished_replicates import Replicates
from .one_replicate import Observe, Pipeline, Replicate, ReplicatePlan, run_replicate
from .store import ReplicateStore

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
        identity: Names what the store cannot see: anything in the code that would change the
            draws must change it.
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
    """
    check_function("pipeline", pipeline)
    simulator = _own(pipeline, "simulate", simulate)
    prior = checked_prior(_own(pipeline, "prior", prior))
    check_function("simulate", simulator)
    check_callable("observe", observe)
    check_timeout(timeout)
    check_progress(progress)
    check_text("identity", identity)
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
        kept = stack.enter_context(ReplicateStore(store, settings))
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
