"""On an executor, a simulator that asks for it gets several simulations in a call."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import Job, Keep, run_missing


class Marching:
    """Signals are the seed, and how many were simulated in the same call."""

    together = 4

    def __init__(self, fails=None):
        self.fails = fails

    def simulate(self, theta, seeds):
        if self.fails in seeds:
            raise RuntimeError("went wrong")
        return np.column_stack([seeds, np.full(len(seeds), len(seeds))]).astype(float)


def run(simulator, count, pool):
    jobs = [Job({"a": 1.0}, seed) for seed in range(count)]
    with SimulationBank() as bank:
        found = run_missing(simulator.simulate, jobs, Keep(bank, executor=pool), (2,))
        assert len(bank) == count
    return found


@pytest.mark.parametrize(
    ("count", "calls"), [(10, [4, 4, 2]), (8, [4, 4]), (5, [3, 2]), (2, [1, 1]), (1, [1])]
)
def test_calls_are_as_large_as_leaves_work_for_every_worker(count, calls):
    with ThreadPoolExecutor(2) as pool:
        found = run(Marching(), count, pool)
    assert [one.signal[0] for one in found] == list(range(count))
    assert [one.signal[1] for one in found] == [size for size in calls for _ in range(size)]


def test_a_run_that_fails_costs_only_itself():
    with ThreadPoolExecutor(2) as pool:
        found = run(Marching(fails=2), 8, pool)
    assert [one.signal is None for one in found] == [seed == 2 for seed in range(8)]
    assert "went wrong" in found[2].error
    assert [one.signal[1] for one in found if one.signal is not None] == [1.0] * 3 + [4.0] * 4
