"""How often a dozen runs at draws of the posterior find a fault of the emulator in a part of it.

The emulator learned from a simulator whose output, in a quarter of the posterior, is not what the
runs at draws show: there they are of parameters two posterior sds further along a random direction.
Without run-to-run noise: runs as noisy as the data cannot tell such a fault from their noise.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.special import ndtr, ndtri

from bolfi_liquids import inference

TIME = np.linspace(0.2, 4.0, 16)
RUNS = 12
FAULTY, SHIFT = 0.25, 2.0  # share of the posterior, and sds
FITS, NULLS = 40, 100  # of each simulator


class Task(NamedTuple):
    """A simulator without noise, and the sd of its data's."""

    prior: inference.Prior
    simulate: Callable[..., np.ndarray]
    noise: float


def line(theta, seeds):
    return theta["a"][:, None] * np.linspace(0.5, 2.0, 8)


def decay(theta, seeds):
    return theta["a"][:, None] * np.exp(-theta["b"][:, None] * TIME)


def two_numbers(theta, seeds):
    return np.stack([np.sin(3.0 * theta["a"]) + theta["b"], theta["b"] - theta["a"]], -1)


UNIT = dist.Uniform(0, 1)
TASKS = {
    "line": Task(inference.Prior({"a": UNIT}), line, 0.3),
    "decay": Task(
        inference.Prior({"a": dist.Uniform(1, 6), "b": dist.Uniform(0.2, 3)}), decay, 0.2
    ),
    "two numbers": Task(inference.Prior({"a": UNIT, "b": UNIT}), two_numbers, 0.1),
}


def found(task: Task, shift: float, seed: int) -> bool:
    """Whether the runs at draws do not confirm a fit."""
    rng, prior = np.random.default_rng([seed, 3]), task.prior
    truth = prior.from_unit(0.15 + 0.7 * rng.random((1, len(prior))))
    data = task.simulate(truth, [0])[0]
    data = data + task.noise * rng.standard_normal(data.shape)
    quiet = {"confirm": 0, "progress": False, "warn": False}
    made = inference.fit(task.simulate, prior, data, noise=task.noise, seed=seed, **quiet).history
    engine = inference.Bolfi(prior, data, noise=task.noise, seed=seed)
    engine.tell(prior.to_dict(made.theta), made.signals, made.seeds)
    before = engine.fit(warn=False)
    population, (mean, sd) = before.population, before.population.moments
    direction = rng.standard_normal(len(prior))
    direction /= np.linalg.norm(direction)

    def along(x):
        return (x - mean) / sd @ direction

    order = np.argsort(along(population.x))
    above = np.cumsum(population.weights[order]) > 1.0 - FAULTY
    drawn = engine.confirm(before, RUNS)
    x = ndtri(prior.to_unit(drawn))
    faulty = along(x) > along(population.x)[order][above][0]
    x = x + shift * sd * direction * faulty[:, None]
    engine.tell(drawn, task.simulate(prior.from_unit(ndtr(x)), [0]), 10_000 + np.arange(RUNS))
    return not engine.fit(warn=False).confirmed


@pytest.mark.benchmark
def test_faults_in_a_quarter_of_the_posterior_are_found():
    """Prints; run with `pytest -m benchmark -s tests/benchmarks/test_local_faults.py`."""
    shares = {}
    for shift, fits in ((SHIFT, FITS), (0.0, NULLS)):
        told = {
            name: sum(found(task, shift, seed) for seed in range(fits))
            for name, task in TASKS.items()
        }
        print(f"shift of {shift:g} sds: {told}, of {fits} each", flush=True)
        shares[shift] = sum(told.values()) / (fits * len(TASKS))
    assert shares[SHIFT] >= 0.8 and shares[0.0] <= 0.01
