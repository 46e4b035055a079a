"""The usual loop: ask, simulate, store, tell."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from .bank import Simulation, SimulationBank
from .base import Acquisition, Simulator
from .bolfi import MIN_LEARN, Bolfi, checked_integer
from .families import Family
from .posterior import Fit
from .prior import Prior
from .simulate import Job, jobs, run_missing, simulation_seed


def fit(  # noqa: PLR0913  the one call that most users make
    simulate: Simulator,
    prior: Prior,
    observed: ArrayLike,
    *,
    budget: int = 20,
    batch: int = 2,
    seed: int = 0,
    surrogate: str | Family | None = None,
    acquisition: str | Acquisition | None = None,
    initial: int | None = None,
    executor: Executor | None = None,
    bank: str | Path | SimulationBank = ":memory:",
    identity: str = "",
    progress: bool = False,
    **options: Any,
) -> Fit:
    """Infer the parameters of `simulate` from `observed` with `budget` simulations.

    A shell over `Bolfi`. Each round asks `batch` points, takes from the bank those that were
    simulated before, simulates the others, stores them, and tells. Seeds derive from `seed`
    and the simulation's index, so the same call with the same bank repeats nothing that was
    finished and concludes the same, also after a crash.

    Args:
        simulate: Callable (theta: name -> [b], seeds: [b]) -> signals [b, *signal_shape].
            An exception costs one run; a row of NaN reports a failed one.
        prior: The parameters and their priors.
        observed: The measured signal [*signal_shape], time first; NaN is a missing sample.
        budget: Simulations in all, failed ones and those found in the bank included.
        batch: Points per round.
        seed: Fixes the whole run.
        surrogate, acquisition, discrepancy, threshold, transform: See `Bolfi`.
        initial: Points of the start design; None is 2 d + 3.
        executor: Simulates each point in a call of its own; None makes one call per round.
        bank: A path, or a bank that other runs share; it is left open then.
        identity: Names the simulator and its settings in the bank. Anything that changes
            the signals for equal theta and seed must change it.
        progress: Show a bar.

    Raises:
        ValueError: bad argument; budget smaller than the start design; signals of wrong shape.
        RuntimeError: no run of the start design succeeded.
    """
    batch = checked_integer("batch", batch)
    budget = checked_integer("budget", budget, MIN_LEARN)
    engine = Bolfi(
        prior,
        observed,
        surrogate=surrogate,
        acquisition=acquisition,
        seed=seed,
        initial=initial,
        capacity=budget,
        **options,
    )
    if budget < engine.initial:
        raise ValueError(
            f"budget={budget} is smaller than the start design of initial={engine.initial} points; "
            "raise budget or lower initial"
        )
    with ExitStack() as stack:
        if not isinstance(bank, SimulationBank):
            bank = stack.enter_context(SimulationBank(bank))
        advance = stack.enter_context(_bar(budget)) if progress else _no_bar
        runner = partial(run_missing, simulate, bank=bank, identity=identity, executor=executor)
        seconds = _spend(engine, runner, budget, batch, advance)
    return engine.fit({"simulator": seconds})


def _spend(
    engine: Bolfi,
    runner: Callable[[list[Job], tuple[int, ...] | None], list[Simulation]],
    budget: int,
    batch: int,
    advance: Callable[[int], None],
) -> float:
    """Tell the engine `budget` simulations; returns the seconds they took."""
    seconds, errors = 0.0, []
    while engine.told < budget:
        first = engine.told
        theta = engine.ask(min(batch, budget - first))
        seeds = [simulation_seed(engine.seed, i) for i in range(first, engine.asked)]
        results = runner(jobs(theta, seeds), engine.expected_shape)
        engine.tell(theta, _signals(results, engine.signal_shape), seeds)
        seconds += sum(result.seconds for result in results)
        errors += [result.error for result in results if result.error]
        if engine.told >= engine.initial and engine.succeeded == 0:
            raise RuntimeError(
                f"all {engine.told} simulations of the start design failed; the first error: "
                f"{errors[0] if errors else 'the discrepancy was not finite'}"
            )
        advance(len(results))
    return seconds


def _signals(results: list[Simulation], shape: tuple[int, ...]) -> np.ndarray:
    """Signals [n, *signal_shape], rows of NaN where a run failed."""
    good = [r.signal for r in results if r.signal is not None]
    if len({signal.shape for signal in good}) > 1:
        raise ValueError(
            f"simulate must return signals of one shape, got {[s.shape for s in good]}"
        )
    empty = np.full(good[0].shape if good else shape, np.nan)
    return np.stack([empty if r.signal is None else r.signal for r in results])


@contextmanager
def _bar(total: int) -> Iterator[Callable[[int], None]]:
    columns = TextColumn("simulations"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns) as bar:
        task = bar.add_task("", total=total)
        yield lambda n: bar.advance(task, n)


def _no_bar(_: int) -> None: ...
