"""What is read of a reference's pours, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest

from . import strip_pours
from .pours import open_poured_liquids

VOLUME_OF_FLUID = Path(__file__).parents[2] / "data/pour_reference"


def test_liquids_go_from_thin_to_thick_and_from_wetting_to_not(poured):
    assert tuple(poured) == strip_pours.NAMES
    thick = poured["thick_contact_110"]
    assert (thick.viscosity, thick.density, thick.surface_tension) == (1.0, 1000.0, 0.06)
    assert thick.cups.source.contact_angle_deg == 110.0 and thick.cups.pour.hold == 1.5
    assert np.degrees(thick.angular_velocity) == pytest.approx([45.0, 90.0])
    assert thick.retained_resolved and not poured["filmy_contact_30"].retained_resolved


def test_a_table_without_landings_is_compared_at_its_distances(poured):
    slow, fast = poured["thick_contact_110"].pours
    assert slow.landing is None and slow.retained == pytest.approx(0.05)
    assert slow.distance == pytest.approx(strip_pours.DISTANCES)
    expected = strip_pours.spilled(0.011, strip_pours.DISTANCES, 0.05)
    assert slow.spilled == pytest.approx(expected, abs=1e-6)
    assert fast.angular_velocity > slow.angular_velocity


def test_landings_tell_the_mean_and_every_distance(poured):
    slow, _ = poured["thick_contact_60"].pours
    assert slow.landing == pytest.approx(0.004)
    assert slow.distance == pytest.approx(np.arange(0.0, 0.0701, 0.0025))
    expected = strip_pours.spilled(0.004, slow.distance, 0.1)
    assert slow.spilled == pytest.approx(expected, abs=1e-3)


def test_the_reference_of_volume_of_fluid_is_as_it_is_described():
    """Mean landings [mm] and retained fractions as its description has them."""
    found = {one.name: one for one in open_poured_liquids(VOLUME_OF_FLUID)}
    water, glycerin = found["water_contact_60"], found["glycerin_contact_60"]
    assert 1e3 * water.pours[1].landing == pytest.approx(47.2, abs=0.1)
    assert 1e3 * glycerin.pours[1].landing == pytest.approx(-12.9, abs=0.1)
    assert found["gel_contact_60"].pours[0].retained == pytest.approx(0.48, abs=0.005)
    for one in found.values():
        assert one.cups.pour.hold == pytest.approx(0.9 + 4.0 * min(one.viscosity, 0.3))
    assert not found["oil_contact_30"].retained_resolved
    assert found["glycerin_contact_110"].cups.contact_angle == pytest.approx(np.radians(110.0))


def edited(file, old, new):
    def edit(pours):
        path = pours / file
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new, 1))

    return edit


def in_truths(old, new):
    return edited("pour_truths.csv", old, new)


def landed_elsewhere(pours):
    """All bins 10 mm further out, as if another lip had been the origin."""
    path = pours / "pours_landings.json"
    landings = json.loads(path.read_text())
    for place in landings["cases"]["thin_45"]["x_y_fraction"]:
        place[0] += 10
    path.write_text(json.dumps(landings))


def twice(pours):
    table = pours / "pours.csv"
    row = next(line for line in table.read_text().splitlines() if line.startswith("thick,45.0,2.0"))
    table.write_text(table.read_text() + row + "\n")


FAULTS = {
    "no table": (lambda pours: (pours / "wetting.csv").unlink(), "wetting.csv: no such file"),
    "no column": (in_truths("hold_s", "hold"), "hold_s"),
    "no density": (in_truths("thick,1,1000", "thick,1,0"), r"line 4: .*\n?density_kg_m3"),
    "mN/m": (in_truths("1000,0.06,", "1000,60,"), "surface_tension_N_m"),
    "resolved": (in_truths("1.5,no", "1.5,maybe"), "retained_resolved"),
    "two rows": (in_truths("0.001,1000,0.06,110", "0.001,1000,0.06,60"), "two rows of a liquid"),
    "no row": (edited("pours.csv", "thick,45", "honey,45"), "no row for {'honey'}"),
    "same place": (twice, "two rows of thick at 45 deg/s are alike"),
    "no origin": (landed_elsewhere, "thin at 45 deg/s spill .* more or less than the table"),
    "no shares": (edited("pours_landings.json", '"x_y_fraction"', '"xyf"'), "x_y_fraction"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_refused(pours, fault):
    make, told = FAULTS[fault]
    make(pours)
    with pytest.raises(ValueError, match=told):
        open_poured_liquids(pours)
