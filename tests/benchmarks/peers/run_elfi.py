"""ELFI's BOLFI with its defaults, learning log Delta; runs in ELFI's own environment."""

from __future__ import annotations

import sys
import time
from typing import Any

import elfi
import numpy as np
from tasks import Task

from .job import Job, Stopwatch, load, receive, scores, write

DRAWS = 1000  # a chain of four; the first half of them ELFI's warm-up


def build(task: Task, simulate: Stopwatch, observed: np.ndarray) -> Any:
    """ELFI's graph; its node "log_discrepancy" is to be learned."""
    model = elfi.ElfiModel()
    for name, (low, high) in task.ranges.items():
        elfi.Prior("uniform", low, high - low, model=model, name=name)

    def simulator(*columns, batch_size=1, random_state=None):
        seeds = random_state.randint(2**31 - 1, size=batch_size)
        return simulate(task.theta(np.stack([np.ravel(c) for c in columns], axis=-1)), seeds)

    def discrepancy(signals, observed):
        return np.array([task.discrepancy(observed[0][0], signal) for signal in signals])

    parameters = [model[name] for name in task.names]
    elfi.Simulator(simulator, *parameters, observed=observed[None], model=model, name="signals")
    elfi.Discrepancy(discrepancy, model["signals"], model=model, name="discrepancy")
    elfi.Operation(np.log, model["discrepancy"], model=model, name="log_discrepancy")
    return model


def main(job: Job, imported: float) -> None:
    """One run through all budgets; engine seconds are those of a run that stopped at each."""
    task, observed, reference = load(job)
    simulate = Stopwatch(task.simulate)
    model = build(task, simulate, observed)
    bolfi = elfi.BOLFI(model["log_discrepancy"], bounds=dict(task.ranges), seed=job.seed)
    spent = 0.0
    for n in job.budgets:
        if n < bolfi.n_initial_evidence:  # by its default 2^d + 1: it would have no surrogate
            error = f"a start design of {bolfi.n_initial_evidence} simulations"
            write(job, n=n, import_s=imported, version=elfi.__version__, error=error)
            continue
        before, simulator = time.process_time(), simulate.seconds
        bolfi.set_objective(n)
        while not bolfi.finished:
            bolfi.iterate()
        spent += time.process_time() - before - (simulate.seconds - simulator)
        before = time.process_time()
        posterior = bolfi.fit(n, bar=False)  # nothing left to simulate, only to conclude
        concluded = time.process_time() - before
        row = {"n": n, "engine_s": spent + concluded, "simulator_s": simulate.seconds}
        row.update(import_s=imported, simulations=simulate.runs, version=elfi.__version__)
        try:
            row.update(scores(posterior.logpdf, reference))
        except ValueError as error:  # GPy's hyperparameters may run away to NaN
            write(job, **row, error=str(error))
            continue
        write(job, **row, **(sample(bolfi) if job.timed else {}))


def sample(bolfi: Any) -> dict[str, object]:
    """CPU seconds of NUTS, or why it stopped."""
    before = time.process_time()
    try:
        bolfi.sample(DRAWS)
    except ValueError as error:  # such as «invalid stepsize 0.0»
        bolfi.target_model.is_sampling = False
        return {"nuts_error": str(error)}
    return {"nuts_s": time.process_time() - before}


if __name__ == "__main__":
    spent_on_imports = time.process_time()
    main(receive(sys.argv[1]), spent_on_imports)
