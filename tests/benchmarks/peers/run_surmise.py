"""surmise: emulator of the whole output and its calibrator; in surmise's own environment.

Outputs and data are divided by the Cholesky factor of the noise, for surmise takes variances only.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from importlib.metadata import version

import numpy as np
from scipy.stats import qmc
from surmise import set_RNG
from surmise.calibration import calibrator
from surmise.emulation import emulator
from tasks import Task

from .job import Job, Stopwatch, conclude, load, receive

SAMPLER = {  # that of surmise's examples
    "sampler": "PTLMC",
    "theta0": None,
    "nSamples": 800,
    "nChains": 8,
    "samplesPerChain": 100,
    "nTemperatures": 4,
    "maxTemperature": 30,
    "verbose": False,
}


class Prior:
    """Uniform on a task's box, as surmise asks for it."""

    def __init__(self, task: Task, rng: np.random.Generator):
        self._bounds, self._rng = task.bounds, rng

    def rnd(self, n: int) -> np.ndarray:
        return self._rng.uniform(*self._bounds.T, (n, len(self._bounds)))

    def lpdf(self, theta: np.ndarray) -> np.ndarray:
        low, high = self._bounds.T
        inside = ((theta >= low) & (theta <= high)).all(axis=1, keepdims=True)
        return np.where(inside, 0.0, -np.inf)


def main(job: Job, imported: float) -> None:
    """Each budget from nothing, on a Latin hypercube."""
    task, observed, reference = load(job)
    for n in job.budgets:
        row = {"n": n, "import_s": imported, "version": version("surmise")}
        conclude(job, row, reference, partial(learn, job, task, observed, n, row))


def learn(job: Job, task: Task, observed: np.ndarray, n: int, row: dict):
    """Posterior density: points [n, d] -> [n]; puts CPU seconds and simulations into `row`."""
    rng = np.random.default_rng([job.seed, n])
    set_RNG(rng)
    simulate, factor = Stopwatch(task.simulate), np.linalg.cholesky(task.noise)
    theta = qmc.scale(qmc.LatinHypercube(len(task.names), seed=rng).random(n), *task.bounds.T)
    signals = simulate(task.theta(theta), rng.integers(2**31 - 1, size=n))
    before = time.process_time()
    outputs = np.linalg.solve(factor, task.view(signals).T)  # [outputs, n]
    data = np.linalg.solve(factor, task.view(observed[None])[0])
    varying = np.ptp(outputs, axis=1) > 0.0  # surmise refuses others
    outputs, data = outputs[varying], data[varying]
    x = np.arange(len(data), dtype=float)[:, None]
    emulated = emulator(x=x, theta=theta, f=outputs, method="PCGPwM")
    variances, prior = np.ones(len(data)), Prior(task, rng)
    how = {"method": "directbayeswoodbury", "args": dict(SAMPLER)}
    found = calibrator(emu=emulated, y=data, x=x, thetaprior=prior, yvar=variances, **how)
    row["engine_s"] = time.process_time() - before
    row.update(simulator_s=simulate.seconds, simulations=simulate.runs)
    return lambda points: found.theta.lpdf(points).ravel()


if __name__ == "__main__":
    spent_on_imports = time.process_time()
    main(receive(sys.argv[1]), spent_on_imports)
