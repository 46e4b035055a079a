"""Profiles of pours, and the action at which least is expected to be spilled."""

import numpy as np
import pytest
from scipy.special import ndtr

from bolfi_liquids import models
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.pouring.spillage import (
    DISTANCE_STEP,
    Outcomes,
    Profiles,
    landed,
    landing_sd,
    surface,
)

RATES = np.geomspace(0.5, 3.0, 9)


def profiles_of(spilled):
    """Of one draw, from a function of rate and distance."""
    outcomes = Outcomes({}, 1000.0, bundled_cups(), np.zeros(1, int))
    values = spilled(RATES[:, None], outcomes.distances)[:, None]
    fractions = np.stack([values, 1.0 - values, 0.0 * values], axis=-1)
    return Profiles(RATES, outcomes.distances, fractions)


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


def test_a_step_is_blurred_as_a_normal_error_blurs_it():
    cups = bundled_cups()
    edge = 0.03 + DISTANCE_STEP / 2
    blurred = surface(profiles_of(lambda rate, p: np.where(p < edge, 1.0, 0.0) + 0 * rate), cups)
    expected = ndtr((edge - blurred.distance) / landing_sd(cups))
    assert np.abs(blurred.spilled[0] - expected).max() < 0.01
    assert blurred.distance[0] == 0.0 and blurred.distance[-1] == 0.07


def test_the_middle_of_where_nothing_is_spilled_is_taken():
    """Not its edge, where an error of a millimetre spills."""
    cups = bundled_cups()
    best = surface(
        profiles_of(lambda rate, p: np.where(np.abs(p - 0.04) < 0.015, 0.0, 1.0) + 0 * rate), cups
    ).least("mean")
    assert best["distance"] == pytest.approx(0.04, abs=2 * DISTANCE_STEP)


def test_risks_choose_differently():
    """One draw in ten spills much at 2 cm, none at 5 cm."""
    cups = bundled_cups()
    made = profiles_of(lambda rate, p: 5.0 * np.abs(p - 0.02) + 0 * rate)
    usual, rare = (np.repeat(made.fractions, n, axis=1) for n in (9, 1))
    rare[..., 0] = 0.2 + 20.0 * np.abs(made.distance - 0.05)
    tried = surface(made._replace(fractions=np.concatenate([usual, rare], axis=1)), cups)
    assert tried.least("mean")["distance"] == pytest.approx(0.02, abs=3 * DISTANCE_STEP)
    assert tried.least("cvar")["distance"] == pytest.approx(0.05, abs=3 * DISTANCE_STEP)


def test_a_shifted_landing_is_a_shifted_receiver():
    made = profiles_of(lambda rate, p: p + 0 * rate)
    fractions = landed(made.fractions[0], made.distance, 0.03, np.array([-0.01, 0.0, 0.01]))
    assert fractions[:, 0] == pytest.approx([0.04, 0.03, 0.02])
    assert fractions.sum(axis=1) == pytest.approx(1.0)


def test_profiles_of_other_distances_are_others(monkeypatch):
    """What a bank holds of fewer distances is not taken for that of more."""
    outcomes = Outcomes({}, 1000.0, bundled_cups(), np.zeros(1, int))
    before = outcomes.identity
    assert Outcomes({}, 1000.0, bundled_cups(), np.zeros(1, int)).identity == before
    monkeypatch.setattr("bolfi_liquids.pouring.spillage.LANDING_SD", 0.04)
    assert outcomes.identity != before
