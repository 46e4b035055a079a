"""Pours that are simulated once for all distances."""

import numpy as np

from bolfi_liquids import models
from bolfi_liquids.inputs.cups import bundled_cups

from .outcomes import Outcomes


def test_one_simulation_serves_every_distance():
    """Of each distance it says what a pour into a receiver there says.

    The cups turn fast and not for long after: what is compared is bits.
    """
    bundled = bundled_cups()
    cups = bundled.model_copy(update={"pour": bundled.pour.model_copy(update={"hold": 0.2})})
    theta = {"viscosity": np.array([0.01, 1.0]), "cohesion": np.array([0.2, 0.5])}
    outcomes = Outcomes(theta, 1100.0, cups, np.array([3, 4]))
    fractions = outcomes.simulate({"angular_velocity": np.array([7.0, 9.0])}, np.zeros(2, int))
    assert fractions.shape == (2, 2, len(outcomes.distances), 3)
    at = [np.argmin(np.abs(outcomes.distances - d)) for d in (0.01, 0.05)]
    distances = np.repeat(outcomes.distances[at], 2)
    liquids = models.Liquid(*(np.tile(theta[n], 2) for n in theta), density=1100.0)
    poured = models.pour(liquids, models.PourAction(9.0, distances), cups, [3, 4, 3, 4])
    together = np.stack([poured.spilled, poured.received, poured.retained], axis=-1)
    assert len(np.unique(together[:, 0])) == 4  # each spills another part
    for column, expected in zip(at, np.split(together, 2), strict=True):
        np.testing.assert_array_equal(fractions[1, :, column], expected)


def test_profiles_of_other_distances_are_others(monkeypatch):
    """What a bank holds of fewer distances is not taken for that of more."""
    outcomes = Outcomes({}, 1000.0, bundled_cups(), np.zeros(1, int))
    before = outcomes.identity
    assert Outcomes({}, 1000.0, bundled_cups(), np.zeros(1, int)).identity == before
    monkeypatch.setattr("bolfi_liquids.pouring.spillage.LANDING_SD", 0.04)
    assert outcomes.identity != before
