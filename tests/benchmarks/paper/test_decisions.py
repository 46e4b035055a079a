"""What is chosen on a map of all liquids, and carried out."""

import numpy as np
import pytest
from bolfi_liquids.inference.simulations import Compute

from bolfi_liquids import inference, models
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.progress import silent

from .decisions import decide, decide_unknowing, execute, map_of_all_liquids
from .truths import draw_truths

HALF_STREAM = 0.03  # m, of what lands evenly about its middle


def best_distance(viscosity):
    """The middle of the made-up stream [m]: thick liquids fall close to the lip."""
    return 0.05 - 0.005 * np.log(viscosity / 3e-3)


def landings(liquid, angular_velocity, cups, seeds, particles=0, effects=None):
    """In place of pours: all lands on a line, whatever the angular velocity."""
    middle = best_distance(np.broadcast_to(liquid.viscosity, len(seeds)))
    position = np.zeros((len(seeds), 300, 2), np.float32)
    position[..., 0] = middle[:, None] + HALF_STREAM * np.linspace(-1.0, 1.0, 300)
    return models.Landings(position, np.zeros(len(seeds)))


def spilled(viscosity, distance):
    """By these pours."""
    off = np.abs(distance - best_distance(viscosity))
    reach = bundled_cups().receiver.radius
    return np.clip((off + HALF_STREAM - reach) / (2.0 * HALF_STREAM), 0.0, 1.0)


@pytest.fixture
def landing_map(monkeypatch):
    monkeypatch.setattr(models, "landings", landings)
    with inference.SimulationBank(":memory:") as bank:
        yield map_of_all_liquids(64, Compute(bank=bank))


def test_rules_decide_and_what_they_decide_is_carried_out(landing_map):
    """theta* is thin, the draws are thick: the plug-in pours for the one, the rules for these."""
    draws = np.geomspace(1.0, 4.0, 16)
    concluded = np.column_stack([np.append(0.01, draws), np.full(17, 0.5)])
    actions = decide(concluded, landing_map)
    assert actions["plug_in"]["distance"] == pytest.approx(best_distance(0.01), abs=3e-3)
    assert actions["mean"]["distance"] == pytest.approx(best_distance(2.0), abs=3e-3)
    truths = draw_truths(1, 0)
    chosen = [list(actions.values())] * len(truths.seed)
    with inference.SimulationBank(":memory:") as bank:
        found = np.array(execute(truths, chosen, landing_map, Compute(bank=bank), silent))
    for column, action in enumerate(actions.values()):
        known = spilled(truths.viscosity, action["distance"])
        assert found[:, column] == pytest.approx(known, abs=0.01)


def test_without_a_calibration_the_pour_is_for_the_middle_of_the_prior(landing_map):
    action = decide_unknowing(landing_map, default_prior(), 0)
    middle = float(default_prior().from_unit(np.full((1, 2), 0.5))["viscosity"][0])
    assert action["distance"] == pytest.approx(best_distance(middle), abs=0.01)


def test_the_first_truths_do_not_depend_on_how_many_there_are():
    few, many = draw_truths(2, 7), draw_truths(5, 7)
    first = many.repetition < 2
    for ours, theirs in zip(few, many, strict=True):
        np.testing.assert_array_equal(ours, theirs[first])
    assert len(np.unique(many.seed)) == len(many.seed)
