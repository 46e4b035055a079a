"""What was simulated once is taken from the bank."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import BatchSimulator, Compute
from bolfi_liquids.inference.simulations.failures import FailureKind, not_finite

from bolfi_liquids.run.simulations import (
    CURES,
    simulate_kept,
)
from bolfi_liquids.simulators import FluidSimulator


@dataclass(frozen=True)
class Made(FluidSimulator):
    """A function in place of the fluid."""

    function: Callable
    identity: str = "line"
    time_limit = None  # a function cannot stop itself

    def simulate(self, theta, seeds):
        return self.function(theta, seeds)

    @property
    def batched(self):
        """It does not stop itself."""
        return BatchSimulator(self.simulate)


def test_only_what_is_missing_is_simulated():
    asked = []

    def simulate(theta, seeds):
        asked.append(seeds.tolist())
        return (theta["a"] + 100.0 * seeds)[:, None]

    theta = {"a": np.array([0.0, 1.0, 2.0, 3.0, 4.0])}
    with SimulationBank() as bank:
        compute = Compute(bank=bank, batch=2)
        first = simulate_kept(Made(simulate), {"a": theta["a"][1:3]}, [6, 7], compute)
        np.testing.assert_array_equal(first.signals[:, 0], [601.0, 702.0])
        whole = simulate_kept(Made(simulate), theta, [5, 6, 7, 8, 9], compute)
        np.testing.assert_array_equal(whole.signals[:, 0], [500.0, 601.0, 702.0, 803.0, 904.0])
        simulate_kept(Made(simulate, "other"), theta, [5, 6, 7, 8, 9], compute)
    assert asked == [[6, 7], [5], [8], [9], [5, 6], [7, 8], [9]]


def test_diverged_ones_are_left_out():
    def simulate(theta, seeds):
        return np.where(theta["a"] > 1.0, np.nan, theta["a"])[:, None]

    with SimulationBank() as bank:
        compute = Compute(bank=bank, batch=8)
        kept = simulate_kept(Made(simulate), {"a": np.array([0.0, 2.0, 1.0])}, [1, 2, 3], compute)
        np.testing.assert_array_equal(kept.signals, [[0.0], [1.0]])
        assert kept.places.tolist() == [0, 2]
        with pytest.raises(RuntimeError, match="all 1 simulations failed"):
            simulate_kept(Made(simulate), {"a": np.array([2.0])}, [2], compute)


def failing(theta, seeds):
    if theta["a"][0] > 1.0:
        raise OSError("the disk is full")
    if theta["a"][0] < 0.0:
        time.sleep(30.0)
    return np.full((1, 1), np.nan)


@pytest.mark.parametrize(
    ("a", "failure"),
    [(2.0, FailureKind.RAISED), (0.5, FailureKind.NOT_FINITE), (-1.0, FailureKind.TIMEOUT)],
)
def test_where_all_fail_the_advice_is_of_their_kind(a, failure):
    with SimulationBank() as bank, pytest.raises(RuntimeError) as failed:
        simulate_kept(
            Made(failing),
            {"a": np.array([a])},
            [1],
            Compute(bank=bank, batch=1, executor=None, timeout=0.05),
        )
    assert [kind for kind, cure in CURES.items() if cure in str(failed.value)] == [failure]


def test_simulations_that_failed_are_counted_with_the_first_reason(caplog):
    """A bar counts them as done."""

    def simulate(theta, seeds):
        if theta["a"][0] > 3.0:
            time.sleep(30.0)
        if theta["a"][0] > 2.0:
            raise OSError("the disk\nis full")
        return np.where(theta["a"] > 1.0, np.nan, theta["a"])[:, None]

    theta = {"a": np.array([0.0, 2.0, 3.0, 1.0, 4.0])}
    with SimulationBank() as bank:
        for repeated in range(2):  # what the bank holds is told again
            caplog.clear()
            compute = Compute(bank=bank, batch=1, timeout=0.2)
            before = [None, not_finite("it diverged")]
            simulate_kept(Made(simulate), theta, [1, 2, 3, 4, 5], compute, before=before)
            overdue, failed = caplog.records
            assert overdue.args == (1, 7, 0.2), repeated
            assert failed.args[:2] == (3, 7) and "\n" not in failed.getMessage()
