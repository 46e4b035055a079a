"""The map of spillage, against pours whose outcome is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.inference import SimulationBank

from bolfi_liquids import models
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.map import make_map, make_pours

POURS = 256
NOISE = 0.02


def spilled(viscosity, rate, distance):
    """What is spilled without chance: least at a distance that depends on the liquid."""
    best = 0.045 - 0.008 * np.log10(viscosity / 3e-3)
    miss = (distance - best) / 0.03
    return 1.0 - np.exp(-0.5 * miss**2 - 0.2 * np.log(rate / 0.8) ** 2)


def pour(liquid, action, cups, seeds):
    chance = np.array([np.random.default_rng(seed).normal(0.0, NOISE) for seed in seeds])
    sure = spilled(liquid.viscosity, action.angular_velocity, action.distance)
    return SimpleNamespace(spilled=np.clip(sure + chance, 0.0, 1.0))


@pytest.fixture(scope="module")
def made():
    """The map, and how many pours were made for it in calls that were interrupted."""
    count = []

    def counted(liquid, action, cups, seeds):
        if sum(count) >= POURS // 2 and len(stop):
            raise KeyboardInterrupt
        count.append(len(seeds))
        return pour(liquid, action, cups, seeds)

    stop = [True]
    with pytest.MonkeyPatch.context() as patch, SimulationBank() as bank:
        patch.setattr(models, "pour", counted)
        same = {"prior": default_prior(), "pours": POURS, "progress": False}
        with pytest.raises(KeyboardInterrupt):
            make_pours(bundled_cups(), 1000.0, bank, **same)
        stop.clear()
        spillage = make_map(bundled_cups(), 1000.0, bank, **same)
        make_map(bundled_cups(), 1000.0, bank, **same)
    return spillage, sum(count)


def liquids(viscosity, count=400):
    rng = np.random.default_rng(1)
    spread = viscosity * np.exp(0.2 * rng.normal(size=count))
    return {"viscosity": spread, "cohesion": rng.uniform(size=count)}


@pytest.mark.slow
def test_no_pour_is_made_twice(made):
    assert made[1] == POURS


@pytest.mark.slow
@pytest.mark.parametrize("viscosity", [0.01, 0.1, 1.0, 10.0])
def test_expected_spillage_is_that_of_the_pours(made, viscosity):
    spillage = made[0]
    drawn = liquids(viscosity)
    outcomes = spillage.outcomes(drawn).mean(axis=0)
    rate, distance = spillage.actions.T
    truth = spilled(drawn["viscosity"][:, None], rate, distance).mean(axis=0)
    assert np.sqrt(np.mean((outcomes - truth) ** 2)) < 2.0 * spillage.error.rms
    best = spillage.best(drawn)
    there = spilled(drawn["viscosity"], best.angular_velocity, best.distance)
    assert abs(best.spillage - there.mean()) < 2.0 * spillage.error.rms
    # what the chosen action loses to the best one of the grid
    assert there.mean() - truth.min() < spillage.error.rms


@pytest.mark.slow
def test_one_outcome_in_twenty_exceeds_the_bound(made):
    spillage, rng = made[0], np.random.default_rng(2)
    above, count = 0, 0
    for viscosity in (0.01, 0.1, 1.0, 10.0):
        drawn = liquids(viscosity)
        best = spillage.best(drawn)
        sure = spilled(drawn["viscosity"], best.angular_velocity, best.distance)
        there = np.clip(sure + rng.normal(0.0, NOISE, sure.size), 0.0, 1.0)
        above += (there > best.spillage_q95).sum()
        count += there.size
    assert above / count < 0.05


@pytest.mark.slow
def test_errors_are_those_of_pours_that_were_left_out(made):
    error = made[0].error
    assert error.pours == POURS // 8
    # chance alone makes NOISE; the map adds less than as much again
    assert 0.5 * NOISE < error.rms < 2.5 * NOISE


def test_too_few_pours_are_refused():
    with SimulationBank() as bank, pytest.raises(ValueError, match="pours: 8"):
        make_pours(bundled_cups(), 1000.0, bank, prior=default_prior(), pours=8)


@pytest.mark.parametrize(
    ("pours", "viscosities"),
    [
        pytest.param(128, (1.0,), marks=pytest.mark.minutes),
        pytest.param(512, (0.03, 1.0), marks=pytest.mark.minutes),  # the map that `pour` makes
    ],
)
def test_simulated_pours_of_the_best_action_spill_as_expected(pours, viscosities):
    """Within twice the error that the map states and that 24 pours leave open."""
    cups = bundled_cups()
    with SimulationBank() as bank:
        spillage = make_map(cups, 1260.0, bank, prior=default_prior(), pours=pours, progress=False)
    for viscosity in viscosities:
        drawn = liquids(viscosity, 24)
        best = spillage.best(drawn)
        action = models.PourAction(best.angular_velocity, best.distance)
        liquid = models.Liquid(**drawn, density=1260.0)
        poured = models.pour(liquid, action, cups, np.arange(24) + 5).spilled
        # the map's error for little spillage, and what 24 pours leave open
        error = spillage.error.rms_little + 2.0 * poured.std() / np.sqrt(24)
        print(f"{poured.mean():.3f} spilled, {best.spillage:.3f} expected, error {error:.3f}")
        assert abs(poured.mean() - best.spillage) < 2.0 * error
        # with one in twenty, five of 24 have a chance of 0.006
        assert (poured > best.spillage_q95).sum() < 5
