"""PyVBMC with its defaults, but for the budget; in PyVBMC's own environment.

It learns from the exact log likelihood; "vbmc_noisy" from that with a normal error of known sd.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from importlib.metadata import version

import numpy as np
from pyvbmc import VBMC
from tasks import Task

from .job import Job, conclude, load, receive

NOISE = 1.0  # sd of the noisy log likelihood
PLAUSIBLE = 0.16, 0.84  # quantiles of the prior, as its documentation advises


def main(job: Job, imported: float) -> None:
    """Each budget from nothing; an evaluation of the likelihood counts as a simulation."""
    task, observed, reference = load(job)
    for n in job.budgets:
        row = {"n": n, "import_s": imported, "version": version("pyvbmc"), "simulator_s": 0.0}
        conclude(job, row, reference, partial(learn, job, task, observed, n, row))


def learn(job: Job, task: Task, observed: np.ndarray, n: int, row: dict):
    """Posterior density: points [n, d] -> [n]; puts CPU seconds and evaluations into `row`."""
    rng, evaluated, noisy = np.random.default_rng([job.seed, n]), [], job.engine == "vbmc_noisy"

    def log_joint(point: np.ndarray):  # the prior is uniform
        started = time.process_time()
        value = float(task.log_likelihood(observed, task.theta(np.atleast_2d(point)))[0])
        evaluated.append(time.process_time() - started)
        return (value + NOISE * rng.standard_normal(), NOISE) if noisy else value

    low, high = task.bounds.T[:, None]
    plausible = [low + share * (high - low) for share in PLAUSIBLE]
    options = {"display": "off", "show_tips": False, "max_fun_evals": n}
    options["specify_target_noise"] = noisy
    before = time.process_time()
    vbmc = VBMC(log_joint, None, low, high, *plausible, options=options, seed=job.seed)
    found, _ = vbmc.optimize()
    row["engine_s"] = time.process_time() - before - sum(evaluated)
    row["simulations"] = len(evaluated)
    inside = 1e-9 * (high - low)  # no density on the very ends
    return lambda points: found.log_pdf(np.clip(points, low + inside, high - inside)).ravel()


if __name__ == "__main__":
    spent_on_imports = time.process_time()
    main(receive(sys.argv[1]), spent_on_imports)
