"""What is judged of several pours, where it is known."""

import numpy as np
import pytest

from bolfi_liquids.checks.across_pours import across_pours, shift
from bolfi_liquids.checks.physics_records import finished_record
from bolfi_liquids.checks.pour_replay import pour_case


def records(liquids, simulate):
    """As a check keeps them."""
    cases = [pour_case(one, simulate) for one in liquids]
    done = [finished_record(case, case.run(lambda _: None, 0), 0, 0.0) for case in cases]
    return {record["name"]: record for record in done}


def rows(poured, simulate):
    found = across_pours(poured.values(), records(poured.values(), simulate))
    return {row.quantity: row for row in found}


THIN = "shift, thin 45 deg/s, 60 to 110 deg [mm]"
THICK = "shift, thick 90 deg/s, 60 to 110 deg [mm]"


def test_a_perfect_repetition_keeps_every_bar(poured, off):
    found = rows(poured, off())
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
    found = rows(poured, off(**{f"{name}_contact_110": moved}))
    row = found[THIN if name == "thin" else THICK]
    assert row.error == pytest.approx(1e3 * moved, abs=0.5) and row.passed is passes


def test_both_angles_off_by_the_same_leave_the_shift(poured, off):
    found = rows(poured, off(thin_contact_60=0.006, thin_contact_110=0.006))
    assert found[THIN].error == pytest.approx(0.0, abs=0.2)
    assert found["mean RMS, wetting.csv"].ours > 0.05


def test_each_table_has_means_of_its_own(poured, off):
    far = {f"{name}_contact_110": -0.02 for name in ("thin", "thick")}
    found = rows(poured, off(**far))
    assert found["mean RMS, pours.csv"].passed and not found["mean RMS, wetting.csv"].passed
    quantity = "mean spilled beyond the least"
    assert found[f"{quantity}, pours.csv"].passed and not found[f"{quantity}, wetting.csv"].passed


def test_a_mean_is_over_pours_and_not_over_liquids(poured, off):
    done = records(poured.values(), off(thin_contact_60=0.01))
    noted = [
        pour["rms"]
        for name in ("thin_contact_60", "filmy_contact_30", "thick_contact_60")
        for pour in done[name]["notes"]["pours"]
    ]
    found = {row.quantity: row for row in across_pours(poured.values(), done)}
    assert found["mean RMS, pours.csv"].ours == pytest.approx(np.mean(noted))


def test_a_failed_simulation_fails_what_it_is_part_of(poured, off):
    done = records(poured.values(), off())
    pour = done["thin_contact_110"]["notes"]["pours"][0]
    pour.update(retained=None, excess=None, spilled=[None] * len(pour["spilled"]))
    found = {row.quantity: row for row in across_pours(poured.values(), done)}
    assert not found[THIN].passed and found[THICK].passed
    assert not found["mean spilled beyond the least, wetting.csv"].passed


def test_only_what_was_poured_is_compared(poured, off):
    whole = [one for one in poured.values() if one.table == "pours.csv"]
    done = records(whole, off())
    names = [row.quantity for row in across_pours(poured.values(), done)]
    assert names == ["mean RMS, pours.csv", "mean spilled beyond the least, pours.csv"]
    done["thin_contact_60"]["panels"] = []  # of one that raised: a mean without it says nothing
    assert across_pours(poured.values(), done) == ()


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
