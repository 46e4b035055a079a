"""Turned liquids of any law of viscosity, against closed forms."""

import numpy as np
import pytest
from truths.cup_flows import driven_swirl
from truths.generalised_flows import generalised_swirl

R, DRIVE = 0.04, 5e4  # m, Pa/m²
r = np.linspace(0.0, R, 60)


def turned(viscosity):
    return generalised_swirl(r, radius=R, drive=DRIVE, viscosity=viscosity)


def test_a_constant_viscosity_gives_the_cubic():
    expected = driven_swirl(r, lambda at: DRIVE / 1000.0 * at, R, 2e-3)
    np.testing.assert_allclose(turned(lambda rate: 2.0), expected, atol=1e-4 * expected.max())


def test_a_power_law_is_integrated():
    """K rate^n = drive r²/4: the rate goes as r^(2/n), and so does the turn's difference."""
    consistency, index = 3.0, 0.5
    scale = (DRIVE / (4.0 * consistency)) ** (1.0 / index) * index / 2.0
    expected = r * scale * (R ** (2.0 / index) - r ** (2.0 / index))
    ours = turned(lambda rate: consistency * rate ** (index - 1.0))
    np.testing.assert_allclose(ours, expected, atol=1e-5 * expected.max())


def test_a_gel_turns_rigidly_where_its_stress_is_below_the_yield_stress():
    """Bingham's law: the rate is (stress - yield stress) / viscosity beyond the plug."""
    viscosity, stress = 2.0, 8.0
    plug = np.sqrt(4.0 * stress / DRIVE)
    sheared = np.maximum(r, plug)
    turn = DRIVE / 8.0 * (R**2 - sheared**2) - stress * np.log(R / sheared)
    ours = turned(lambda rate: viscosity - stress * np.expm1(-1e4 * rate) / rate)
    np.testing.assert_allclose(ours, r * turn / viscosity, atol=2e-3 * ours.max())


def test_a_stress_that_no_rate_has_is_refused():
    with pytest.raises(ValueError, match="no shear rate"):
        turned(lambda rate: 1.0 / (1.0 + rate))
