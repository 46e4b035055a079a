"""Our engine, by the surrogates of `SURROGATES`."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.inference.engine_version import ENGINE_VERSION
from tasks import Task

from bolfi_liquids import inference

from .job import Job, Stopwatch, conclude, load, receive, write

BATCH = 2  # points asked at once, `inference.fit`'s default
WINDOW = 10  # simulations from a budget on over which the median cost of a step is taken
CALL = {"confirm": 0, "warn": False, "progress": False}  # runs at draws would come on top of N
COMPILED = "/jax/core/compile/backend_compile_duration"


class Setting(NamedTuple):
    """How a task is put to the engine.

    Attributes:
        view: signals [b, *signal_shape] -> what the engine is told.
        options: Of `inference.fit` and `inference.Bolfi`.
    """

    view: Callable[[np.ndarray], np.ndarray]
    options: dict[str, Any]


SURROGATES: dict[str, Callable[[Task], Setting]] = {
    "discrepancy": lambda task: Setting(
        lambda signals: signals, {"surrogate": "discrepancy", "discrepancy": task.discrepancy}
    ),
    "signal": lambda task: Setting(task.view, {"noise": 0.0 if task.noise is None else task.noise}),
}


class Question(NamedTuple):
    """All that `inference.fit` is asked."""

    prior: inference.Prior
    observed: np.ndarray
    simulate: Stopwatch
    options: dict[str, Any]


def question(job: Job, task: Task, observed: np.ndarray) -> Question:
    prior = inference.Prior({name: dist.Uniform(*range_) for name, range_ in task.ranges.items()})
    setting = SURROGATES[job.engine](task)
    simulate = Stopwatch(lambda theta, seeds: setting.view(task.simulate(theta, seeds)))
    seen = setting.view(observed[None])[0]
    return Question(prior, seen, simulate, {**setting.options, "seed": job.seed})


def posterior(job: Job, imported: float) -> None:
    """Each budget; where `timed` twice over, the second run finding all compiled."""
    task, observed, reference = load(job)
    for i, n in enumerate(job.budgets):
        asked = question(job, task, observed)
        row = {"n": n, "import_s": imported, "version": version(), "fresh": i == 0}
        conclude(job, row, reference, partial(learn, asked, n, job.timed, row))


def learn(asked: Question, n: int, timed: bool, row: dict[str, Any]):
    """Log density of the posterior: points [n, d] -> [n]; puts CPU seconds into `row`."""
    run, log_density = fit(asked, n, timed)
    if timed:
        row |= {f"first_{name}": run[name] for name in ("engine_s", "nuts_s")}
        run, log_density = fit(asked, n, timed)
    row |= run
    return log_density


def fit(
    asked: Question, n: int, timed: bool
) -> tuple[dict[str, float], Callable[[np.ndarray], np.ndarray]]:
    """One run from nothing: its CPU seconds, and the log density of its posterior."""
    simulate = asked.simulate
    runs, simulator, before = simulate.runs, simulate.seconds, time.process_time()
    fitted = inference.fit(simulate, asked.prior, asked.observed, budget=n, **CALL, **asked.options)
    simulator = simulate.seconds - simulator
    engine = time.process_time() - before - simulator
    spent = {"engine_s": engine, "simulator_s": simulator, "simulations": simulate.runs - runs}
    if timed:
        before = time.process_time()
        fitted.sample("nuts", chains=4, draws=1000)
        spent["nuts_s"] = time.process_time() - before
    return spent, lambda points: fitted.log_prob(asked.prior.to_dict(points))


def steps(job: Job, imported: float) -> None:
    """CPU seconds of ask and tell at each budget, and compilations up to it, in one run."""
    task, observed, _ = load(job)
    asked = question(job, task, observed)
    compiled = Compilations()
    engine = inference.Bolfi(asked.prior, asked.observed, **asked.options)
    told, spent, programs = [], [], []
    while engine.told < max(job.budgets) + WINDOW:
        told.append(engine.told)
        programs.append(compiled.count)
        before, simulator = time.process_time(), asked.simulate.seconds
        theta = engine.ask(BATCH)
        seeds = np.arange(engine.told, engine.told + BATCH) + 1000 * job.seed
        engine.tell(theta, asked.simulate(theta, seeds), seeds)
        spent.append(time.process_time() - before - (asked.simulate.seconds - simulator))
    for n in job.budgets:
        here = slice(np.searchsorted(told, n), np.searchsorted(told, n + WINDOW))
        row = {"step_s": float(np.median(spent[here])), "compilations": programs[here.start]}
        write(job, n=n, **row, import_s=imported, version=version())


class Compilations:
    """Counts what XLA compiles from now on.

    Attributes:
        count: Programs compiled.
    """

    def __init__(self) -> None:
        self.count = 0
        jax.monitoring.register_event_duration_secs_listener(self._hear)

    def _hear(self, event: str, _: float, **__: Any) -> None:
        self.count += event == COMPILED


def version() -> str:
    return f"engine {ENGINE_VERSION}, jax {jax.__version__}"


KINDS = {"posterior": posterior, "steps": steps}

if __name__ == "__main__":
    spent_on_imports = time.process_time()
    given = receive(sys.argv[1])
    KINDS[given.kind](given, spent_on_imports)
