"""What a bank holds is not simulated again."""

import numpy as np
from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import Compute

from .kept_simulator import keeping


def test_a_simulator_that_keeps_repeats_nothing_that_was_finished():
    asked = []

    def simulate(theta, seeds):
        asked.extend(seeds.tolist())
        return np.where(theta["a"] > 1.0, np.nan, theta["a"] + seeds)[:, None]

    theta, seeds = {"a": np.array([0.0, 2.0, 1.0])}, np.array([1, 2, 3])
    with SimulationBank() as bank:
        kept = keeping(simulate, (1,), Compute(bank=bank, batch=2))
        for _ in range(2):
            np.testing.assert_array_equal(kept(theta, seeds), [[1.0], [np.nan], [4.0]])
        np.testing.assert_array_equal(kept({"a": np.array([1.0])}, np.array([4])), [[5.0]])
    assert [asked.count(seed) for seed in (1, 3, 4)] == [1, 1, 1]
