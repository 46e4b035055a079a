"""Pours as a simulator that can be criticised."""

import numpy as np
import pytest

from bolfi_liquids import models
from bolfi_liquids.criticism.pours import Fractions
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.seeds import Phase, simulation_seeds
from bolfi_liquids.simulators import PourSimulator

RATE = np.radians([160.0, 120.0, 160.0, 180.0, 120.0])  # neither sorted nor once each
DISTANCE = np.array([0.01, 0.03, 0.04, 0.02, -0.01])
DENSITY = 1000.0


@pytest.mark.slow
def test_each_pour_spills_what_it_spills_alone():
    cups, seeds = bundled_cups(), np.array([3, 5])
    theta = {"viscosity": np.array([0.01, 1.0]), "cohesion": np.array([0.2, 0.7])}
    pours = PourSimulator(cups, DENSITY, Fractions(RATE, DISTANCE))
    signals = pours.simulate(theta, seeds)
    rates = np.unique(RATE)
    for run, seed in enumerate(seeds):
        one = {name: values[run] for name, values in theta.items()}
        drawn = simulation_seeds(int(seed), Phase.RUNS_OF_POURS, len(rates))
        own = np.array(drawn)[np.searchsorted(rates, RATE)]
        alone = models.pour(
            models.Liquid(**one, density=DENSITY), models.PourAction(RATE, DISTANCE), cups, own
        )
        np.testing.assert_array_equal(signals[run], [alone.spilled, alone.retained])
