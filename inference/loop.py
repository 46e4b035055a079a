"""The usual loop: ask, simulate, store, tell."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import checks, criticism
from .arguments import (
    check_called,
    check_flag,
    check_function,
    check_progress,
    check_runs,
    check_text,
    checked_integer,
    require,
)
from .bolfi import MIN_LEARN, MOST_SIMULATIONS, Bolfi
from .prior import Prior, checked_prior
from .progress import progress_bar
from .result import MUCH_DOUBT, Fit, Recipe
from .simulations.bank import Simulation, SimulationBank
from .simulations.compute import Workers, open_compute
from .simulations.job import BATCH, Job, Limit, columns, for_engine, jobs, simulation_seed
from .simulations.program import check_names
from .simulations.runner import Runner
from .sobol import start_size
from .surrogates.base import Acquisition, Family
from .surrogates.families import check_options
from .surrogates.warnings import complain
from .types import Simulator, SingleSimulator
from .until import Until, checked_budget, enough


def fit(  # noqa: PLR0913  the one call that most users make
    simulate: Simulator | SingleSimulator,
    prior: Prior,
    observed: ArrayLike | None = None,
    *,
    budget: int | str | Until = 20,
    batch: int = BATCH,
    seed: int = 0,
    surrogate: str | Family | None = None,
    acquisition: str | Acquisition | None = None,
    initial: int | None = None,
    executor: Workers | None = None,
    bank: str | Path | SimulationBank = ":memory:",
    identity: str = "",
    timeout: float | None = None,
    together: int = 1,
    time_limit: Limit | None = None,
    earlier: tuple[Any, ...] | None = None,
    vectorised: bool = True,
    in_rounds: bool = True,
    confirm: int = 3,
    warn: bool = True,
    progress: bool | Callable[[int], object] = True,
    **options: Any,
) -> Fit:
    """Infer the parameters of `simulate` from `observed` with `budget` simulations.

    A shell over `Bolfi`: it asks for points, takes from the bank those that were simulated
    before, simulates and stores the others, and tells them in the order asked. Seeds derive from
    `seed` and the simulation's index. So the same call with the same bank repeats nothing that
    was finished and concludes the same, bit for bit, also after a crash; with a larger budget it
    goes on where it ended.

    Rounds of `batch` points are asked together. Without an executor a round is simulated in one
    call; with one, every simulation is a call of its own, or in a pool up to `together` of them
    are. With in_rounds=False `batch` simulations are kept in flight instead: point i is asked as
    soon as all up to i - batch have been told, while the others still run. Which points are
    simulated depends on `batch` and `in_rounds`, but neither on the executor nor on what finishes
    first.

    Args:
        simulate: Callable (theta: name -> [b], seeds: [b]) -> signals [b, *signal_shape]; or,
            with vectorised=False, (theta: name -> float, seed) -> signal [*signal_shape].
            A run that raises, takes too long, returns NaN or something else than a signal costs
            that run only, see `Fit.failures`; a masked value is NaN.
        prior: The parameters and their priors.
        observed: The measured signal [*signal_shape], time first, also where a `summary` is taken;
            NaN is a missing sample. None, and only so, with surrogate="log_likelihood": `simulate`
            then returns log likelihoods [b], or [b, 2] with the sd of their noise; -inf where the
            data are impossible.
        budget: Simulations in all, failed ones and those found in the bank included; at most 8192,
            earlier ones counted. Or an `Until`, which ends when the posterior is known well
            enough; "auto" is `Until()`.
        batch: Points per round, or in flight: as many as the executor has workers.
        seed: Fixes the whole run.
        surrogate, acquisition: See `Bolfi`.
        initial: Points of the start design; None is 2 d + 6, or the budget if that is less.
        executor: A thread or process pool, a Dask client or any other
            `concurrent.futures.Executor`, left open; or a Dask scheduler's address such as
            `"tcp://host:8786"`. Start processes by "spawn" or "forkserver": JAX does not survive
            a fork. Workers import `simulate`, but not JAX.
        bank: A path, or a bank that other runs share; it is left open then. Every simulation
            is stored when its call is finished, and what another run is simulating for the same
            bank at the same time is waited for.
        identity: Names the simulator and its settings in the bank, which needs it. Anything that
            changes the signals for equal theta and seed must change it. A `Program`'s is its
            command and the names of its functions, unless one is given; not the program's version.
        timeout: Seconds that one simulation may take; those of one call together as many times
            as long, and if it fails they are tried one by one. `simulate` then runs in a
            thread, which is abandoned, not stopped, when it is overdue: see `job.within`.
        together: Simulations that a pool's worker makes in one call of a simulator that makes
            several faster than one by one.
        time_limit: How `simulate` stops itself: inside `with time_limit(seconds)` it raises
            TimeoutError once it has taken so long, and stays in its thread.
        earlier: Your own simulations (theta, signals), (theta, signals, seeds), as
            `SimulationBank.simulations` returns them, or (theta, signals, seeds, errors), as
            `Fit.history.why` has them; see `Bolfi.tell`. theta may be a data frame. They are
            learned from like the others, take the place of the start design's points, and count
            beside the budget, which may then be 0. Their posterior is confirmed, too, unless
            `simulate` is None.
        vectorised: Whether `simulate` makes a batch of runs in one call; False calls it once
            for each run, such as `simulate({"a": 1.0}, seed)`.
        in_rounds: Whether points are asked a round at a time. False asks the next one as soon as
            a simulation is told: an executor's workers then never wait for the slowest run of a
            round, and other points are simulated than in rounds.
        confirm: Runs beyond the budget at draws of the posterior, which tell whether it is known:
            once, and again while they move it, twice in all or up to half the budget; 0 for none.
            See `Fit.confirmed`.
        warn: Whether each of the surrogate's complaints is raised as an `EmulatorWarning`;
            `Fit.warnings` holds them in any case.
        progress: Whether to show a bar on stderr; or a function that is called with 1 for each
            simulation.
        options: Of the surrogate's family, see `Bolfi`. Editors know those of
            `surrogate=SignalFamily(noise=0)` or `DiscrepancyFamily(...)`, which are checked
            before anything is simulated.

    Raises:
        ValueError: bad argument; budget smaller than the start design; none of the first four runs
            returned a signal.
        RuntimeError: no run of the start design succeeded, or fewer than three in all, of which
            the bank keeps those that did; the executor lost its workers.
        ImportError, ConnectionError: Dask is not installed, or does not answer.

    Warns:
        EmulatorWarning: for each of the surrogate's complaints, unless warn=False. Where warnings
            are errors (`python -W error`), the first ends the call: a bank on disk has every
            simulation then, and warn=False returns the fit.

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
        >>> fit = inference.fit(simulate, prior, observed, budget=12, noise=0, vectorised=False)
        >>> fit.status
        'fitted'
    """
    batch = checked_integer("batch", batch, 1, MOST_SIMULATIONS)
    least = MIN_LEARN if earlier is None else 0
    budget, until = checked_budget(budget, least)
    confirm = checked_integer("confirm", confirm, 0, MOST_SIMULATIONS)
    confirm = 0 if simulate is None else confirm
    check_progress(progress)
    check_text("identity", identity)
    check_options(options, fit)
    for name, flag in {"vectorised": vectorised, "in_rounds": in_rounds, "warn": warn}.items():
        check_flag(name, flag)
    if budget or simulate is not None:
        check_function("simulate", simulate)
        check_called("simulate", simulate, "theta", "seeds" if vectorised else "seed")
    simulator = for_engine(simulate, vectorised, together, time_limit)
    identity = identity or simulator.identity
    check_runs("earlier", earlier, 2, 3, 4)
    names = checked_prior(prior).names
    told = 0 if earlier is None else len(np.atleast_2d(prior.to_array(earlier[0])))
    check_names(simulator, names)
    due = f"hold {MOST_SIMULATIONS - budget} simulations at most with budget={budget}"
    require(
        budget + told <= MOST_SIMULATIONS, "earlier", due, told, cure="leave the least useful out"
    )
    if initial is None:
        initial = max(MIN_LEARN, min(start_size(len(prior)), budget + told))
    engine = Bolfi(
        prior,
        observed,
        surrogate=surrogate,
        acquisition=acquisition,
        seed=seed,
        initial=initial,
        **options,
    )
    if earlier is not None:
        engine.tell(*earlier)
    _check_reaches_start(engine, budget)
    with ExitStack() as stack:
        compute = stack.enter_context(open_compute(executor, timeout, batch, bank))
        bound = "at most" if until else "at least" if confirm else ""
        bar = progress_bar("simulations", budget + confirm, shown=progress, bound=bound)
        advance = stack.enter_context(bar)
        runner = stack.enter_context(
            Runner(simulator, compute, shape=engine.expected_shape, identity=identity)
        )
        schedule = _in_rounds if in_rounds else _in_flight
        finished = schedule(engine, runner, budget, batch, enough(engine, until, runner.bank.where))
        for _ in finished:
            advance(1)
        _check_learnable(engine, runner)
        budget = engine.told - told
        if simulate is not None:
            own = {
                **{"surrogate": engine.family, "acquisition": acquisition, "timeout": timeout},
                **{"initial": engine.initial, "batch": batch, "in_rounds": in_rounds},
                **({} if earlier is None else {"earlier": earlier}),
                "confirm": confirm,
            }
            engine.recipe = Recipe(
                *(simulator, identity, until or budget, own, fit),
                # each room is imported when it is entered
                check=lambda *given, **how: checks.check_fit(*given, **how),
                criticise=lambda *given, **how: criticism.criticise_fit(*given, **how),
            )
        made = engine.fit({"simulator": runner.seconds}, warn=False)
        if simulate is None and made.learned.unreached:  # a table of losses, not of outputs
            raise ValueError(made.learned.unreached[0])
        for _ in range(_confirmations(engine, budget, confirm)):
            for _ in _confirmation(engine, made, runner, confirm):
                advance(1)
            made = engine.fit({"simulator": runner.seconds}, warn=False)
            if made.confirmed and made.doubt < MUCH_DOUBT:
                break
    if warn:
        complain(made.warnings, stacklevel=3)
    return made


def _check_reaches_start(engine: Bolfi, budget: int) -> None:
    due = f"reach the start design of initial={engine.initial} points"
    cure = "raise budget or lower initial"
    require(budget + engine.told >= engine.initial, "budget", due, budget, cure=cure)


def _check_learnable(engine: Bolfi, runner: Runner) -> None:
    if engine.succeeded < MIN_LEARN:
        raise RuntimeError(
            f"{engine.succeeded} of {engine.told} simulations succeeded, copies counted once; "
            f"{MIN_LEARN} are needed{engine.history.last_error}. {runner.bank.where}; mend the "
            "cause, or raise budget, and repeat the call to go on from there"
        )


def _in_rounds(
    engine: Bolfi, runner: Runner, budget: int, batch: int, stop: Callable[[], bool]
) -> Iterator[Simulation]:
    """Simulate `batch` points at a time; yields what the engine was told."""
    for first in range(0, budget, batch):
        if stop():
            return
        indices = range(first, min(first + batch, budget))
        # whole rounds are asked even if the budget ends before, so that a larger one goes on
        # from the same points
        asked = jobs(engine.ask(batch), [simulation_seed(engine.seed, i) for i in indices])
        yield from _tell(engine, runner, asked, runner.run(asked))


def _in_flight(
    engine: Bolfi, runner: Runner, budget: int, batch: int, stop: Callable[[], bool]
) -> Iterator[Simulation]:
    """Keep `batch` simulations going; yields what the engine was told, in the order asked."""
    flying: deque[tuple[Job, Future[Simulation]]] = deque()

    def land() -> list[Simulation]:
        job, outcome = flying.popleft()
        return _tell(engine, runner, [job], [runner.result(outcome)])

    for index in range(budget):
        if stop():
            break
        if len(flying) == batch:
            yield from land()
        (job,) = jobs(engine.ask(1), [simulation_seed(engine.seed, index)])
        (outcome,) = runner.start([job])
        flying.append((job, outcome))
    while flying:
        yield from land()


def _confirmations(engine: Bolfi, budget: int, n: int) -> int:
    """How often n runs may confirm: twice, or up to half the budget."""
    if not n:
        return 0
    return min(max(2, budget // (2 * n)), (MOST_SIMULATIONS - engine.told) // n)


def _confirmation(engine: Bolfi, made: Fit, runner: Runner, n: int) -> list[Simulation]:
    """Simulate n draws of the posterior; returns what the engine was told."""
    first = max(engine.asked, engine.told)  # earlier runs may be of the same seed
    seeds = [simulation_seed(engine.seed, first + i) for i in range(n)]
    asked = jobs(engine.confirm(made, n), seeds)
    return _tell(engine, runner, asked, runner.run(asked))


def _tell(
    engine: Bolfi, runner: Runner, asked: list[Job], results: list[Simulation]
) -> list[Simulation]:
    """Tell the engine; returns the results.

    Raises:
        RuntimeError: the start design is over, and nothing succeeded.
    """
    theta, seeds = columns(asked)
    errors = [result.error for result in results]
    failed = np.full(engine.history.signal_shape, np.nan)
    signals = [failed if result.signal is None else result.signal for result in results]
    engine.tell(theta, signals, seeds, errors)
    if engine.told >= engine.initial and engine.succeeded == 0:
        raise RuntimeError(
            f"all {engine.told} simulations of the start design failed{engine.history.last_error}"
            f"{runner.how_called(engine.history.errors)}"
        )
    return results
