"""Profiles of pours, and the action at which least is expected to be spilled."""

import numpy as np
import pytest
from scipy.special import ndtr

from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.pouring.spillage import (
    DISTANCE_STEP,
    Profiles,
    landed,
    landing_sd,
    reachable_distances,
    surface,
)

RATES = np.geomspace(0.5, 3.0, 9)


def profiles_of(spilled):
    """Of one draw, from a function of rate and distance."""
    distances = reachable_distances(bundled_cups())
    values = spilled(RATES[:, None], distances)[:, None]
    fractions = np.stack([values, 1.0 - values, 0.0 * values], axis=-1)
    return Profiles(RATES, distances, fractions)


def test_a_step_is_blurred_as_a_normal_error_blurs_it():
    cups = bundled_cups()
    edge = 0.03 + DISTANCE_STEP / 2
    blurred = surface(profiles_of(lambda rate, p: np.where(p < edge, 1.0, 0.0) + 0 * rate), cups)
    expected = ndtr((edge - blurred.distance) / landing_sd(cups))
    assert np.abs(blurred.spilled[0] - expected).max() < 0.01
    assert blurred.distance[0] == 0.0 and blurred.distance[-1] == 0.07


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
