"""What was simulated once is taken from the bank."""

import numpy as np
import pytest
from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import Keep

from bolfi_liquids.run.simulations import (
    keeping,
    simulate_kept,
)


def test_only_what_is_missing_is_simulated():
    asked = []

    def simulate(theta, seeds):
        asked.append(seeds.tolist())
        return (theta["a"] + 100.0 * seeds)[:, None]

    theta = {"a": np.array([0.0, 1.0, 2.0, 3.0, 4.0])}
    with SimulationBank() as bank:
        keep = Keep(bank, "line", 2)
        first = simulate_kept(simulate, {"a": theta["a"][1:3]}, [6, 7], keep)
        np.testing.assert_array_equal(first.signals[:, 0], [601.0, 702.0])
        whole = simulate_kept(simulate, theta, [5, 6, 7, 8, 9], keep)
        np.testing.assert_array_equal(whole.signals[:, 0], [500.0, 601.0, 702.0, 803.0, 904.0])
        simulate_kept(simulate, theta, [5, 6, 7, 8, 9], keep._replace(identity="other"))
    assert asked == [[6, 7], [5], [8], [9], [5, 6], [7, 8], [9]]


def test_diverged_ones_are_left_out():
    def simulate(theta, seeds):
        return np.where(theta["a"] > 1.0, np.nan, theta["a"])[:, None]

    with SimulationBank() as bank:
        keep = Keep(bank, "", 8)
        kept = simulate_kept(simulate, {"a": np.array([0.0, 2.0, 1.0])}, [1, 2, 3], keep)
        np.testing.assert_array_equal(kept.signals, [[0.0], [1.0]])
        with pytest.raises(RuntimeError, match="all 1 simulations failed"):
            simulate_kept(simulate, {"a": np.array([2.0])}, [2], keep)


def test_a_simulator_that_keeps_repeats_nothing_that_was_finished():
    asked = []

    def simulate(theta, seeds):
        asked.extend(seeds.tolist())
        return np.where(theta["a"] > 1.0, np.nan, theta["a"] + seeds)[:, None]

    theta, seeds = {"a": np.array([0.0, 2.0, 1.0])}, np.array([1, 2, 3])
    with SimulationBank() as bank:
        kept = keeping(simulate, (1,), Keep(bank, "line", 2))
        for _ in range(2):
            np.testing.assert_array_equal(kept(theta, seeds), [[1.0], [np.nan], [4.0]])
        np.testing.assert_array_equal(kept({"a": np.array([1.0])}, np.array([4])), [[5.0]])
    assert [asked.count(seed) for seed in (1, 3, 4)] == [1, 1, 1]
