"""sbi's neural estimators, one round on draws of the prior; in sbi's own environment.

Of the posterior ("npe"), of the likelihood ("nle"), and of the posterior by TabPFN ("npe_pfn"),
whose weights must lie in TabPFN's cache.
"""

from __future__ import annotations

import contextlib
import io
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import sbi
import torch
from sbi.inference import NLE, NPE, NPE_PFN
from sbi.utils import BoxUniform
from tabpfn.model_loading import prepend_cache_path
from tasks import Task

from .job import Job, Stopwatch, conclude, load, receive

WEIGHTS = Path(prepend_cache_path("tabpfn-v2-regressor.ckpt"))  # sbi would download them
METHODS = {"npe": NPE, "nle": NLE, "npe_pfn": NPE_PFN}


def main(job: Job, imported: float) -> None:
    """Each budget from nothing; what is learned from is the signal's view, with its noise."""
    torch.set_num_threads(1)
    if job.engine == "npe_pfn" and not WEIGHTS.exists():
        sys.exit(f"npe_pfn needs TabPFN's weights: there is no file {WEIGHTS}")
    task, observed, reference = load(job)
    for n in job.budgets:
        row = {"n": n, "import_s": imported, "version": sbi.__version__, "simulations": n}
        conclude(job, row, reference, partial(learn, job, task, observed, n, row))


def flat(signals: np.ndarray) -> np.ndarray:
    return signals.reshape(len(signals), -1)


def noise(task: Task, n: int, rng: np.random.Generator) -> np.ndarray | float:
    """What the data carry beyond a simulation, [n, view]; 0 where nothing."""
    if task.noise is None:
        return 0.0
    return rng.standard_normal((n, len(task.noise))) @ np.linalg.cholesky(task.noise).T


def learn(job: Job, task: Task, observed: np.ndarray, n: int, row: dict):
    """Posterior density: points [n, d] -> [n]; puts CPU seconds into `row`."""
    rng = np.random.default_rng([job.seed, n])
    torch.manual_seed(job.seed)
    drawn = rng.uniform(*task.bounds.T, (n, len(task.names)))
    simulate = Stopwatch(task.simulate)
    signals = simulate(task.theta(drawn), rng.integers(2**31 - 1, size=n))
    before = time.process_time()
    seen = flat(task.view(signals)) + noise(task, n, rng)
    theta, x, data = (single(a) for a in (drawn, seen, flat(task.view(observed[None]))))
    trainer = METHODS[job.engine](prior=BoxUniform(*single(task.bounds.T)))
    trainer.append_simulations(theta, x)
    with contextlib.redirect_stdout(io.StringIO()):
        trainer.train()
        posterior = trainer.build_posterior().set_default_x(data)
    row.update(engine_s=time.process_time() - before, simulator_s=simulate.seconds)

    def density(points: np.ndarray) -> np.ndarray:
        # the reference normalises: leakage out of the prior need not be sampled
        unnormalised = {} if job.engine == "nle" else {"norm_posterior": False}
        evaluate = posterior.potential if job.engine == "nle" else posterior.log_prob
        with torch.no_grad():
            return evaluate(single(points), **unnormalised).numpy().astype(float)

    return density


def single(values: np.ndarray) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float32)


if __name__ == "__main__":
    spent_on_imports = time.process_time()
    main(receive(sys.argv[1]), spent_on_imports)
