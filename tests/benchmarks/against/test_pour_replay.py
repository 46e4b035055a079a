"""What is measured of repeated pours, where it is known."""

import numpy as np
import pytest
from bolfi_liquids.models import Landings

from . import pour_replay, strip_pours
from .pour_replay import (
    EXCESS,
    HEAD,
    LANDING,
    RETAINED,
    RMS,
    pour_panel,
    pour_rows,
    repeat_pours,
    simulate_pours,
)


def judged(liquid, simulate):
    pours = repeat_pours(liquid, simulate).pours
    return pours, {row.quantity: row for row in pour_rows(pours, liquid.retained_resolved)}


def test_a_perfect_repetition_misses_nothing(poured, off):
    for liquid in poured.values():
        _, rows = judged(liquid, off())
        assert all(row.passed for row in rows.values())
        assert all(abs(row.error) < 2e-3 for row in rows.values() if row.quantity != LANDING)
        assert LANDING not in rows or rows[LANDING].error < 0.2  # mm; particles are .01 apart


def test_a_strip_that_is_moved_is_off_by_as_much(poured, off):
    """On a flank the share beside a receiver grows evenly along the strip."""
    moved = 0.004
    (slow, fast), rows = judged(poured["thin_contact_60"], off(thin_contact_60=moved))
    assert rows[LANDING].ours == pytest.approx(1e3 * moved, abs=0.1)
    expected = [
        expected_rms(middle, moved) for middle in strip_pours.middles(strip_pours.STRIPS[0])
    ]
    assert rows[RMS].ours == pytest.approx(np.mean(expected), abs=2e-3)
    speeds = np.degrees([slow.angular_velocity, fast.angular_velocity])
    assert speeds == pytest.approx([45.0, 90.0])
    assert slow.landing_error == pytest.approx(0.004, abs=1e-4)
    assert str(slow).lstrip().startswith("45 ") and len(str(slow)) == len(HEAD)
    panel = pour_panel(poured["thin_contact_60"].pours[0], slow)
    assert panel.x_label == "distance [cm] at 45 deg/s"


def expected_rms(middle, moved):
    """Where the strip that is not moved has between 2 and 98 % beside the receiver."""
    distances = np.arange(0.0, 0.0701, 0.0025)  # landings tell of more of them than the table
    before = strip_pours.spilled(middle, distances)
    after = strip_pours.spilled(middle + moved, distances)
    judged = (before >= 0.02) & (before <= 0.98)
    return np.sqrt(np.mean((after - before)[judged] ** 2))


def test_the_cost_of_a_wrong_distance_is_what_the_reference_spills_there(poured, off):
    """A strip 15 mm too near is caught whole from 26 mm on, a third of the true one is not."""
    (slow, fast), rows = judged(poured["thin_contact_60"], off(thin_contact_60=-0.015))
    assert slow.best_distance == pytest.approx(0.0275)  # the first of a flat least
    assert slow.excess == pytest.approx(strip_pours.spilled(0.056, 0.0275), abs=1e-3)
    assert rows[EXCESS].ours == max(slow.excess, fast.excess) > 0.2
    assert not rows[EXCESS].passed


@pytest.mark.parametrize(
    ("moved", "passes"),
    [(0.0035, True), (-0.0035, True), (0.0065, False), (-0.0065, False)],
)
def test_a_mean_landing_may_be_off_by_five_millimetres(poured, off, moved, passes):
    _, rows = judged(poured["thick_contact_60"], off(thick_contact_60=moved))
    assert rows[LANDING].passed is passes


@pytest.mark.parametrize(("more", "passes"), [(0.025, True), (0.1, False)])
def test_the_retained_fraction_has_a_bar_where_the_reference_resolves_it(poured, off, more, passes):
    _, rows = judged(poured["thick_contact_60"], off(retained=more))
    assert rows[RETAINED].passed is passes
    assert rows[RETAINED].ours == pytest.approx(more, abs=5e-3)
    (slow, _), rows = judged(poured["filmy_contact_30"], off(retained=more))
    assert RETAINED not in rows
    assert slow.retained_error == pytest.approx(more, abs=5e-3)  # shown, though not judged


def test_a_failed_simulation_fails(poured, off):
    def fails(liquid, seeds, cell):
        landed = off()(liquid, seeds, cell)
        landed.position[-1], landed.retained[-1] = np.nan, np.nan
        return landed

    (slow, fast), rows = judged(poured["thick_contact_60"], fails)
    assert not any(row.passed for row in rows.values())
    assert np.isfinite(slow.rms) and np.isnan(fast.rms) and np.isnan(fast.excess)


def test_the_true_liquid_is_poured_from_a_cup_that_it_wets_as_in_the_reference(poured, monkeypatch):
    given = {}

    def landings(liquid, angular_velocity, cups, seeds, **more):
        given.update(liquid=liquid, rate=angular_velocity, cups=cups, **more)
        return Landings(np.zeros((2, 10, 2), np.float32), np.zeros(2))

    monkeypatch.setattr(pour_replay, "landings", landings)
    simulate_pours(poured["thick_contact_110"], np.zeros(2, int))
    liquid, cups = given["liquid"], given["cups"]
    assert (liquid.viscosity, liquid.density) == (1.0, 1000.0)
    assert liquid.cohesion == pytest.approx(0.06 / 0.08)
    assert np.degrees(given["rate"]) == pytest.approx([45.0, 90.0])
    assert np.degrees(cups.contact_angle) == pytest.approx(110.0)
    assert cups.pour.hold == 1.5 and cups.pour.final_angle_deg == 135.0


@pytest.mark.slow
def test_the_fluid_repeats_pours_in_cells_of_two_sizes(poured):
    liquid = poured["thin_contact_60"]
    coarse = simulate_pours(liquid, np.zeros(2, int), cell=0.007)
    fine = simulate_pours(liquid, np.zeros(2, int), cell=0.005)
    assert fine.position.shape[1] > 2 * coarse.position.shape[1]
    for landed in (coarse, fine):
        assert np.isfinite(landed.retained).all()
        assert np.nanmean(landed.position[..., 0], axis=1).min() > 0.02
