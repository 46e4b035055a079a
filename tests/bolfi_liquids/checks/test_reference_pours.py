"""What is read of a reference's pours, and what is refused, before anything is simulated."""

import json
from pathlib import Path

import numpy as np
import pytest
import strip_pours

from bolfi_liquids.checks.reference import open_reference
from bolfi_liquids.errors import InputError

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
    found = {one.name: one for one in open_reference(VOLUME_OF_FLUID).pours}
    water, glycerin = found["water_contact_60"], found["glycerin_contact_60"]
    assert 1e3 * water.pours[1].landing == pytest.approx(47.2, abs=0.1)
    assert 1e3 * glycerin.pours[1].landing == pytest.approx(-12.9, abs=0.1)
    assert found["gel_contact_60"].pours[0].retained == pytest.approx(0.48, abs=0.005)
    for one in found.values():
        assert one.cups.pour.hold == pytest.approx(0.9 + 4.0 * min(one.viscosity, 0.3))
    assert not found["oil_contact_30"].retained_resolved
    assert found["glycerin_contact_110"].cups.contact_angle == pytest.approx(np.radians(110.0))


def test_pours_are_chosen_by_liquid_and_contact_angle(pours):
    reference = open_reference(pours)
    (one,) = reference.chosen(["thin_contact_110"])
    assert one.name == "thin_contact_110"
    with pytest.raises(InputError, match="^names: no recording or pour 'thin'.*thin_contact_60"):
        reference.chosen(["thin"])


def test_a_directory_may_hold_stirs_and_pours(grid, made_pours):
    for path in made_pours.iterdir():
        (grid / path.name).write_bytes(path.read_bytes())
    reference = open_reference(grid)
    assert len(reference.stirs) == 3 and len(reference.pours) == 5
    assert set(reference.hashes) == {"truths.csv", "pour_truths.csv"}
    chosen = reference.chosen(["thin_contact_60", "gel_v10.nc"])
    assert [one.name for one in chosen] == ["gel_v10", "thin_contact_60"]


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


def other_liquid(pours):
    table = pours / "pours.csv"
    table.write_text(table.read_text() + "honey,45,2,1,1,1\n")


def nothing(pours):
    (pours / "pour_truths.csv").write_text(strip_pours.COLUMNS + "\n")


THICK = "pours.csv,thick,1,1000,0.06,60,1.5,yes"
FAULTS = {
    "no liquid": (nothing, "pour_truths.csv: holds no liquid"),
    "no table": (in_truths("wetting.csv,thin", "dry.csv,thin"), "line 3, column file: no table"),
    "elsewhere": (in_truths("pours.csv,thin", "../pours.csv,thin"), "no table '../pours.csv'"),
    "no cups": (lambda pours: (pours / "cups.toml").unlink(), "cups.toml: no such file"),
    "no column": (in_truths("hold_s", "hold"), "no column 'hold_s'.*give a column"),
    "a word": (in_truths("thick,1,", "thick,very,"), "line 4, column viscosity_Pa_s: 'very' is"),
    "missing": (in_truths("thick,1,1000", "thick,1,"), "density_kg_m3: got ''.*in kg/m³"),
    "no density": (in_truths("thick,1,1000", "thick,1,0"), "density_kg_m3: got '0'"),
    "mN/m": (in_truths("1000,0.06,", "1000,60,"), "surface_tension_N_m: got '60'; give a tension"),
    "angle": (in_truths(",110,", ",190,"), "contact_angle_deg: got '190'; give an angle of 0 to"),
    "hold": (in_truths(THICK, THICK.replace("1.5", "-1")), "hold_s: got '-1'; give 0 to 60 s"),
    "resolved": (in_truths("1.5,no", "1.5,maybe"), "retained_resolved: got 'maybe'; give yes or"),
    "two rows": (in_truths("0.001,1000,0.06,110", "0.001,1000,0.06,60"), "another row of this"),
    "odd name": (in_truths(",thick,", ",Thick 1,"), "no row for 'thick' of pours.csv"),
    "no row": (other_liquid, "no row for 'honey' of pours.csv; add the liquid"),
    "no pours": (in_truths("pours.csv,thick", "pours.csv,thicker"), "no row for 'thick'"),
    "same place": (twice, "thick at 45 deg/s has two rows of 2 cm"),
    "no origin": (landed_elsewhere, "thin at 45 deg/s: at .* cm the landings spill .* than the"),
    "no shares": (
        edited("pours_landings.json", '"x_y_fraction"', '"xyf"'),
        "pours_landings.json: cases.thin_45.x_y_fraction: is missing; give `cases`",
    ),
    "no JSON": (edited("pours_landings.json", "{", ""), "pours_landings.json: not JSON"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named_with_file_field_value_and_cure(pours, fault):
    make, told = FAULTS[fault]
    make(pours)
    with pytest.raises(InputError, match=told) as refused:
        open_reference(pours)
    assert str(refused.value).startswith(str(pours))


def test_a_liquid_that_cannot_name_a_file_is_refused(pours):
    for file in ("pour_truths.csv", "pours.csv", "wetting.csv"):
        path = pours / file
        path.write_text(path.read_text().replace("thick", "Thick 1"))
    with pytest.raises(InputError, match="column liquid: 'Thick 1' cannot name results; rename"):
        open_reference(pours)
