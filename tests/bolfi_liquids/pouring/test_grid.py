"""Pours between those of a grid, and what is chosen from them."""

import numpy as np
import pytest
from bolfi_liquids.inference.simulations import Keep

from bolfi_liquids import inference, models
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring import spillage
from bolfi_liquids.pouring.grid import FINE_GRID, GridSize, make_grid
from bolfi_liquids.progress import silent
from bolfi_liquids.reproduction.decisions import decide, execute
from bolfi_liquids.reproduction.truths import draw_truths


def best_distance(viscosity):
    """Where a made-up pour spills nothing [m]: thick liquids fall close to the lip."""
    return 0.05 - 0.005 * np.log(viscosity / 3e-3)


COARSE = GridSize(viscosities=5, cohesions=2, rates=4)


@pytest.fixture(params=[FINE_GRID, COARSE], ids=["fine", "coarse"])
def grid(request, monkeypatch):
    """Of made-up pours: linear in the log of the viscosity, whatever the angular velocity."""

    def poured(self, action, seeds):
        off = np.abs(self.distances - best_distance(self.theta["viscosity"])[:, None])
        spilled = np.clip(10.0 * off, 0.0, 1.0)
        fractions = np.stack([spilled, 1.0 - spilled, 0.0 * spilled], axis=-1)
        return np.repeat(fractions[None], len(seeds), axis=0)

    monkeypatch.setattr(spillage.Outcomes, "simulate", poured)
    with inference.SimulationBank(":memory:") as bank:
        made = make_grid(
            bundled_cups(), 1000.0, default_prior(), Keep(bank), silent, size=request.param
        )
        viscosities, cohesions, rates = request.param
        assert made.profiles.fractions.shape[:2] == (rates, viscosities * cohesions)
        yield made


def test_between_the_grid_pours_are_between(grid):
    viscosity = np.array([0.004, 0.07, 2.0, 20.0])
    surface = grid.surface({"viscosity": viscosity, "cohesion": np.array([0.0, 0.3, 0.9, 1.0])})
    chosen = surface.distance[np.argmin(surface.spilled[:, 0], axis=-1)]
    assert chosen == pytest.approx(best_distance(viscosity), abs=2e-3)


def test_rules_decide_and_what_they_decide_is_carried_out(grid):
    """theta* is thin, the draws are thick: the plug-in pours for the one, the rules for these."""
    draws = np.geomspace(1.0, 4.0, 16)
    concluded = np.column_stack([np.append(0.01, draws), np.full(17, 0.5)])
    actions = decide(concluded, grid)
    assert actions["plug_in"]["distance"] == pytest.approx(best_distance(0.01), abs=3e-3)
    assert actions["mean"]["distance"] == pytest.approx(best_distance(2.0), abs=3e-3)
    truths = draw_truths(1, 0)
    chosen = [list(actions.values())] * len(truths.seed)
    with inference.SimulationBank(":memory:") as bank:
        spilled = execute(truths, chosen, grid, Keep(bank), lambda steps: None)
    off = np.abs(actions["mean"]["distance"] - best_distance(truths.viscosity))
    assert np.array(spilled)[:, 1] == pytest.approx(np.clip(10.0 * off, 0.0, 1.0), abs=1e-9)


def test_the_first_truths_do_not_depend_on_how_many_there_are():
    few, many = draw_truths(2, 7), draw_truths(5, 7)
    first = many.repetition < 2
    for ours, theirs in zip(few, many, strict=True):
        np.testing.assert_array_equal(ours, theirs[first])
    assert len(np.unique(many.seed)) == len(many.seed)


@pytest.mark.minutes
def test_a_real_grid_says_what_new_pours_spill():
    """Of liquids and seeds that it does not hold, within what chance and interpolation leave."""
    cups, rng = bundled_cups(), np.random.default_rng(5)
    drawn = default_prior().from_unit(rng.uniform(size=(24, 2)))
    with inference.SimulationBank(":memory:") as bank:
        grid = make_grid(cups, 1000.0, default_prior(), Keep(bank), silent)
    surface = grid.surface(drawn)
    rate = grid.profiles.angular_velocity[4]
    made = models.landings(models.Liquid(**drawn, density=1000.0), rate, cups, np.arange(24))
    off = spillage.landing_sd(cups) * rng.standard_normal((400, 1))
    for column in (10, 30, 50):
        poured = made.into(surface.distance[column] + off, cups.receiver.radius).spilled.mean(
            axis=0
        )
        missed = poured - surface.spilled[:, 4, column]
        assert np.sqrt(np.mean(missed**2)) < 0.03
