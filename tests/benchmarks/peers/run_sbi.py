"""sbi's neural posterior estimation, one round on draws of the prior; in sbi's own environment."""

from __future__ import annotations

import contextlib
import io
import sys
import time

import numpy as np
import sbi
import torch
from sbi.inference import SNPE
from sbi.utils import BoxUniform
from tasks import Task

from .job import Job, Stopwatch, load, receive, scores, write


def main(job: Job, imported: float) -> None:
    """Each budget from nothing; what is learned from is the signal's view, with its noise."""
    torch.set_num_threads(1)
    task, observed, reference = load(job)
    for n in job.budgets:
        rng = np.random.default_rng([job.seed, n])
        torch.manual_seed(job.seed)
        theta = rng.uniform(*task.bounds.T, (n, len(task.names)))
        simulate = Stopwatch(task.simulate)
        signals = simulate(task.theta(theta), rng.integers(2**31 - 1, size=n))
        before = time.process_time()
        seen = flat(task.view(signals)) + noise(task, n, rng)
        density = learn(task, theta, seen, flat(task.view(observed[None])))
        spent = time.process_time() - before
        row = {"n": n, "engine_s": spent, "simulator_s": simulate.seconds, "import_s": imported}
        row.update(simulations=n, version=sbi.__version__)
        write(job, **row, **scores(density, task, reference))


def flat(signals: np.ndarray) -> np.ndarray:
    return signals.reshape(len(signals), -1)


def noise(task: Task, n: int, rng: np.random.Generator) -> np.ndarray | float:
    """What the data carry beyond a simulation, [n, view]; 0 where nothing."""
    if task.noise is None:
        return 0.0
    return rng.standard_normal((n, len(task.noise))) @ np.linalg.cholesky(task.noise).T


def learn(task: Task, theta: np.ndarray, seen: np.ndarray, observed: np.ndarray):
    """Posterior density of the data [1, view]: points [n, d] -> [n]."""
    low, high = torch.tensor(task.bounds.T, dtype=torch.float32)
    trainer = SNPE(prior=BoxUniform(low, high), show_progress_bars=False)
    trainer.append_simulations(*(torch.tensor(a, dtype=torch.float32) for a in (theta, seen)))
    with contextlib.redirect_stdout(io.StringIO()):
        trainer.train()
    posterior = trainer.build_posterior()
    data = torch.tensor(observed, dtype=torch.float32)

    def density(points: np.ndarray) -> np.ndarray:
        batch = torch.tensor(points, dtype=torch.float32)
        with torch.no_grad():  # the grid normalises: leakage out of the prior need not be sampled
            found = posterior.log_prob(batch, x=data, norm_posterior=False)
        return found.numpy().astype(float)

    return density


if __name__ == "__main__":
    spent_on_imports = time.process_time()
    main(receive(sys.argv[1]), spent_on_imports)
