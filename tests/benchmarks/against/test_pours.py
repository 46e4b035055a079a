"""What is read of a reference's pours, and what is refused."""

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
