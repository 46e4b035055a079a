"""What is judged of several pours, where it is known."""

import numpy as np
import pytest

from .across_pours import mean_rows, shift, shift_rows, wetting_pairs
from .pour_replay import repeat_pours

THIN = "shift, thin 45 deg/s, 60 to 110 deg [mm]"
THICK = "shift, thick 90 deg/s, 60 to 110 deg [mm]"


def rows_of(poured, simulate):
    """Rows of all tables and pairs of liquids, by quantity."""
    done = {name: repeat_pours(one, simulate).pours for name, one in poured.items()}
    rows = []
    for table in ("pours.csv", "wetting.csv"):
        own = [name for name, one in poured.items() if one.table == table]
        rows += mean_rows(table, [pour for name in own for pour in done[name]])
    for pair in wetting_pairs(poured.values()):
        rows += shift_rows(*((one, done[one.name]) for one in pair))
    return {row.quantity: row for row in rows}


def test_a_perfect_repetition_keeps_every_bar(poured, off):
    found = rows_of(poured, off())
    assert all(row.passed for row in found.values())
    assert found[THIN].truth == pytest.approx(5.0, abs=0.3)
    assert found[THICK].truth == pytest.approx(7.0, abs=0.5)  # the films differ, too
    assert found[THICK].ours == pytest.approx(found[THICK].truth, abs=0.1)
    assert len([name for name in found if name.startswith("shift")]) == 4  # two liquids, two speeds


@pytest.mark.parametrize(
    ("name", "moved", "passes"),
    [
        ("thin", 0.0025, True),
        ("thin", 0.0035, False),
        ("thin", -0.0035, False),
        ("thick", 0.0035, True),
        ("thick", 0.0047, False),
    ],
)
def test_the_shift_has_a_bar_by_viscosity(poured, off, name, moved, passes):
    found = rows_of(poured, off(**{f"{name}_contact_110": moved}))
    row = found[THIN if name == "thin" else THICK]
    assert row.error == pytest.approx(1e3 * moved, abs=0.5) and row.passed is passes


def test_wetting_that_changes_nothing_fails(poured, off):
    """Both angles halfway between the two."""
    found = rows_of(poured, off(thin_contact_60=0.0035, thin_contact_110=-0.0015))
    shifts = [row for name, row in found.items() if name.startswith("shift, thin")]
    assert len(shifts) == 2 and not any(row.passed for row in shifts)


def test_both_angles_off_by_the_same_leave_the_shift(poured, off):
    found = rows_of(poured, off(thin_contact_60=0.006, thin_contact_110=0.006))
    assert found[THIN].error == pytest.approx(0.0, abs=0.2)
    assert found["mean RMS, wetting.csv"].ours > 0.05


def test_each_table_has_means_of_its_own(poured, off):
    far = {f"{name}_contact_110": -0.02 for name in ("thin", "thick")}
    found = rows_of(poured, off(**far))
    assert found["mean RMS, pours.csv"].passed and not found["mean RMS, wetting.csv"].passed
    quantity = "mean spilled beyond the least"
    assert found[f"{quantity}, pours.csv"].passed and not found[f"{quantity}, wetting.csv"].passed


def test_a_failed_simulation_fails_what_it_is_part_of(poured, off):
    def fails(liquid, seeds, cell):
        landed = off()(liquid, seeds, cell)
        if liquid.name == "thin_contact_110":
            landed.position[0], landed.retained[0] = np.nan, np.nan
        return landed

    found = rows_of(poured, fails)
    assert not found[THIN].passed and found[THICK].passed
    assert not found["mean spilled beyond the least, wetting.csv"].passed


@pytest.mark.parametrize("by", [-0.012, -0.0031, 0.0, 0.0052, 0.015])
def test_a_moved_curve_is_found_where_it_lies(by):
    """A well as water makes it: a steep flank, a floor, a shallow rise."""
    distance = np.arange(0.0, 0.07, 0.004)

    def well(at):
        return 1.0 / (1.0 + np.exp((at - 0.02) / 0.004)) + 0.3 / (1.0 + np.exp((0.06 - at) / 0.006))

    found = shift(distance, well(distance), well(distance - by))
    assert found == pytest.approx(by, abs=5e-4)


def test_what_is_missing_has_no_shift():
    distance = np.linspace(0.0, 0.06, 9)
    assert np.isnan(shift(distance, np.full(9, np.nan), distance))
