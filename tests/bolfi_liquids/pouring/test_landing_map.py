"""The map of landings against pours that are known in closed form, and what it reuses."""

from dataclasses import replace

import numpy as np
import pytest
from bolfi_liquids.inference.simulations import Compute
from scipy.special import ndtr

from bolfi_liquids import inference
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.landing_map import learn_map
from bolfi_liquids.pouring.parcels import PARCELS, Parcels
from bolfi_liquids.pouring.pours import Box, Poured, joint_prior, pours_in, whole
from bolfi_liquids.pouring.spillage import landing_sd
from bolfi_liquids.simulators import PourSimulator

CUPS = bundled_cups()
STREAM_SD = 0.008  # m, of the pours that are made up
POURS = 48
NOISE = 0.002  # m, by which noisy pours are shifted


@pytest.fixture
def bank():
    with inference.SimulationBank(":memory:") as made:
        yield made


def box_of(effects=(), part=(0.5, 0.75)):
    """A part of the prior's viscosities, all else of it."""
    box = whole(joint_prior(default_prior(), effects, CUPS))
    low, high = box.low.copy(), box.high.copy()
    low[0], high[0] = part
    return replace(box, low=low, high=high)


def pours_of(effects=()):
    return PourSimulator(CUPS, 1000.0, Parcels(), effects)


def poured_in(bank, box, count=POURS, pours=None):
    return pours_in(box, pours or pours_of(box.effects), count, Compute(bank=bank))


def liquids_in(box, count, seed=5):
    rng = np.random.default_rng(seed)
    u = rng.uniform(box.low, box.high, (count, len(box.low)))
    return {name: values for name, values in box.prior.from_unit(u).items()}


def expected(made_up, liquid, rate, distance):
    """Spilled fraction of the made-up pours, averaged over where the liquid may land."""
    kept = 0.3 * liquid["viscosity"] / (1.0 + liquid["viscosity"])
    middle = made_up.middle(liquid["viscosity"], liquid["cohesion"], rate)
    sd, radius = np.hypot(STREAM_SD, landing_sd(CUPS)), CUPS.receiver.radius
    caught = ndtr((distance + radius - middle) / sd) - ndtr((distance - radius - middle) / sd)
    return (1.0 - kept) * (1.0 - caught)


def test_the_map_says_what_every_pour_spills(made_up, bank):
    box = box_of()
    learned = learn_map(box, CUPS, poured_in(bank, box))
    assert learned.rms_error < 0.005
    liquids = liquids_in(box, 64)
    found = learned.surface(liquids, rates=5)
    for row, rate in enumerate(found.angular_velocity):
        for column in (0, 35, 70):
            known = expected(made_up, liquids, rate, found.distance[column])
            missed = found.spilled[:, row, column] - known
            assert np.sqrt(np.mean(missed**2)) < 0.01


def noisy(poured):
    """Pours that are shifted by chance."""
    off = NOISE * np.random.default_rng(2).standard_normal((len(poured.rows), 1))
    rows = poured.rows.copy()
    rows[:, 1 : 1 + PARCELS] += off
    return Poured(poured.theta, rows)


def test_chance_between_pours_counts_in_what_is_expected(made_up, bank):
    """Where spilling begins, a shift either way spills more on average."""
    box = box_of()
    poured = poured_in(bank, box)
    learned, known = (learn_map(box, CUPS, made) for made in (noisy(poured), poured))
    shifts = learned.emulation.missed[:, 1 : 1 + PARCELS].mean(axis=1)
    assert 0.7 * NOISE < np.sqrt(np.mean(shifts**2)) < 1.5 * NOISE
    assert learned.rms_error > 5.0 * known.rms_error
    liquids = liquids_in(box, 1)
    spread = [one.surface(liquids).spilled.std(axis=0).max() for one in (learned, known)]
    assert spread[0] > 5.0 * spread[1]


def test_what_is_wrong_somewhere_is_seen_in_pours_that_are_left_out(made_up, bank):
    """A map that saw each pour would repeat it; the error is of one that did not."""
    box = box_of()
    poured = poured_in(bank, box)
    rows = poured.rows.copy()
    rows[7, 1 : 1 + PARCELS] += 0.02
    learned = learn_map(box, CUPS, Poured(poured.theta, rows))
    worst = np.sqrt(np.mean(learned.error**2, axis=1))
    assert np.argmax(worst) == 7 and worst[7] > 0.1


def test_nothing_is_poured_twice(made_up, bank):
    box = box_of()
    first = poured_in(bank, box)
    assert sum(made_up.calls) == POURS and max(made_up.calls) <= 8
    again = poured_in(bank, box)
    assert sum(made_up.calls) == POURS
    np.testing.assert_array_equal(again.rows, first.rows)
    more = poured_in(bank, box, 2 * POURS)
    assert sum(made_up.calls) == 2 * POURS == len(more.rows)


def test_a_box_takes_what_others_poured_in_it_and_pours_what_they_lack(made_up, bank):
    poured_in(bank, box_of())
    before = sum(made_up.calls)
    box = box_of(part=(0.5625, 0.8125))
    found = poured_in(bank, box)
    assert 0 < sum(made_up.calls) - before < 0.5 * POURS
    assert box.holds(box.prior.to_unit(found.theta)).all()
    few = poured_in(bank, box_of(), 24)
    assert len(few.rows) == POURS and box_of().holds(box.prior.to_unit(few.theta)).all()


def test_other_cups_or_another_density_share_nothing(made_up, bank):
    source = CUPS.source.model_copy(update={"fill": 0.03})
    fuller = replace(pours_of(), cups=CUPS.model_copy(update={"source": source}))
    for pours in (pours_of(), PourSimulator(CUPS, 900.0, Parcels()), fuller):
        poured_in(bank, box_of(), 24, pours)
    assert sum(made_up.calls) == 3 * 24


def test_pours_without_an_effect_are_pours_with_its_neutral_coefficient(made_up, bank):
    poured_in(bank, box_of())
    box = box_of(("adhesion",))
    poured = poured_in(bank, box)
    assert sum(made_up.calls) == 2 * POURS == len(poured.rows)
    assert (poured.theta["adhesion"] == 0.0).sum() == POURS
    learned = learn_map(box, CUPS, poured)
    liquids = {name: np.full(2, values[0]) for name, values in liquids_in(box, 1).items()}
    liquids["adhesion"] = np.array([0.0, 1.0])
    profiles = learned.profiles(np.array([1.3]), liquids, np.zeros(2, int))
    half = np.argmax(profiles.fractions[0, :, :, 1] > 0.3, axis=1)
    assert half[0] - half[1] == pytest.approx(20, abs=2)  # mm nearer


def test_a_pour_that_fails_is_left_out(made_up, bank, monkeypatch):
    landings = made_up.landings

    def failing(liquid, rate, *rest, **more):
        made = landings(liquid, rate, *rest, **more)
        return replace(made, retained=np.where(np.asarray(rate) > 2.5, np.nan, made.retained))

    monkeypatch.setattr("bolfi_liquids.models.landings", failing)
    box = box_of()
    poured = poured_in(bank, box)
    assert 24 < len(poured.rows) < POURS and (poured.theta["angular_velocity"] < 2.5).all()
    assert learn_map(box, CUPS, poured).rms_error < 0.01


def test_too_few_pours_are_no_map(made_up, bank):
    box = box_of()
    poured = poured_in(bank, box, 12)
    with pytest.raises(RuntimeError, match="12 pours.*needs 16"):
        learn_map(box, CUPS, poured)


def test_liquids_beyond_the_box_are_taken_at_its_edge(made_up, bank):
    box: Box = box_of()
    learned = learn_map(box, CUPS, poured_in(bank, box))
    edge = box.prior.from_unit(np.array([[0.75, 0.5, 0.5]]))
    far = {**edge, "viscosity": np.array([19.0])}
    at = np.array([1.0])
    same = (learned.profiles(at, one, np.zeros(1, int)).fractions for one in (edge, far))
    np.testing.assert_allclose(*same, atol=1e-9)
