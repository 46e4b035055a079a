"""On an executor, a simulator that asks for it gets several simulations in a call."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import BatchSimulator, Compute, Job, run_missing
from bolfi_liquids.inference.simulations.job import run_batch


class Marching:
    """Signals are the seed, and how many were simulated in the same call."""

    def __init__(self, fails=None):
        self.fails = fails

    def simulate(self, theta, seeds):
        if self.fails in seeds:
            raise RuntimeError("went wrong")
        return np.column_stack([seeds, np.full(len(seeds), len(seeds))]).astype(float)


def run(simulator, count, pool):
    jobs = [Job({"a": 1.0}, seed) for seed in range(count)]
    with SimulationBank() as bank:
        compute = Compute(bank=bank, executor=pool)
        found = run_missing(BatchSimulator(simulator.simulate, 4), jobs, compute, (2,))
        assert len(bank) == count
    return found


def test_calls_are_as_large_as_the_simulator_likes():
    with ThreadPoolExecutor(2) as pool:
        found = run(Marching(), 10, pool)
    assert [one.signal[0] for one in found] == list(range(10))
    assert [one.signal[1] for one in found] == [4.0] * 8 + [2.0] * 2


def test_a_run_that_fails_costs_only_itself():
    with ThreadPoolExecutor(2) as pool:
        found = run(Marching(fails=2), 8, pool)
    assert [one.signal is None for one in found] == [seed == 2 for seed in range(8)]
    assert "went wrong" in found[2].error.text
    assert [one.signal[1] for one in found if one.signal is not None] == [1.0] * 3 + [4.0] * 4


class Told:
    """Adds up its parameters, and keeps what it was called with."""

    def __init__(self):
        self.calls = []

    def simulate(self, theta, seeds):
        self.calls.append({name: column.tolist() for name, column in theta.items()})
        return np.stack(list(theta.values()), axis=1).sum(axis=1, keepdims=True)


MIXED = [Job({"a": 1.0, "drag": 2.0}, 0), Job({"a": 3.0}, 1), Job({"a": 5.0, "lag": 1.0}, 2)]


def test_runs_of_other_parameters_share_a_call_where_the_simulator_has_their_neutral_values():
    simulator = Told()
    batched = BatchSimulator(simulator.simulate, neutral={"drag": 0.0, "lag": -1.0})
    found = run_batch(batched, MIXED, (1,))
    assert simulator.calls == [
        {"a": [1.0, 3.0, 5.0], "drag": [2.0, 0.0, 0.0], "lag": [-1.0, -1.0, 1.0]}
    ]
    assert [one.signal[0] for one in found] == [2.0, 2.0, 6.0]


def test_elsewhere_each_is_called_with_its_own_parameters_alone():
    simulator = Told()
    found = run_batch(simulator.simulate, MIXED[::-1], (1,))
    assert simulator.calls == [
        {"a": [5.0], "lag": [1.0]},
        {"a": [3.0]},
        {"a": [1.0], "drag": [2.0]},
    ]
    assert [one.signal[0] for one in found] == [6.0, 3.0, 3.0]
