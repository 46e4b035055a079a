"""Cylinders in a stream, rods on a pivot, and drops."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipe
from truths import (
    cylinder_drag,
    oscillating_rod,
    pendulum,
    surfaces,
)

ROD = pendulum.Rod(length=0.14, radius=0.005, mass=0.015)


def test_drag_meets_the_creeping_flow_and_the_computed_one():
    # Kaplun 1957 (J. Math. Mech. 6, 595), after Lamb 1911
    small = 1.0 / (0.5 - np.euler_gamma - np.log(0.1 / 8.0))
    slow = 8.0 * np.pi * small / 0.1 * (1.0 - 0.87 * small**2)
    assert cylinder_drag.drag_coefficient(0.1) == pytest.approx(slow, rel=0.03)
    for reynolds, computed in cylinder_drag.DENNIS_CHANG.items():
        assert cylinder_drag.drag_coefficient(reynolds) == pytest.approx(computed, rel=0.12)


def test_drag_interpolates_its_table_and_falls():
    reynolds, values = cylinder_drag.DRAG_COEFFICIENT.T
    np.testing.assert_allclose(cylinder_drag.drag_coefficient(reynolds), values, rtol=1e-12)
    fine = np.geomspace(0.1, 1000, 300)
    assert (np.diff(cylinder_drag.drag_coefficient(fine)) < 0).all()
    # while the force per length rises with the speed all the way
    assert (np.diff(fine**2 * cylinder_drag.drag_coefficient(fine)) > 0).all()
    with pytest.raises(ValueError, match="0.1 to 1000"):
        cylinder_drag.drag_coefficient(2000.0)


@pytest.mark.parametrize("amplitude", [0.02, 0.5, 1.5])
def test_period_in_air_is_that_of_the_equation_of_motion(amplitude):
    lever = 0.5 * ROD.mass * 9.81 * ROD.length / ROD.inertia

    def rhs(_, state):
        return [state[1], -lever * np.sin(state[0])]

    def at_bottom(_, state):
        return state[0]

    solved = solve_ivp(rhs, (0, 2), [amplitude, 0], events=at_bottom, rtol=1e-10, atol=1e-12)
    expected = 2.0 * (solved.t_events[0][1] - solved.t_events[0][0])
    assert pendulum.period_in_air(amplitude, ROD) == pytest.approx(expected, rel=1e-7)


def test_inertia_is_the_integral_over_the_cylinder():
    """Slices of a rod: x² + r²/4 each."""
    slices, _ = quad(lambda x: x**2 + ROD.radius**2 / 4, 0, ROD.length)
    assert ROD.inertia == pytest.approx(ROD.mass / ROD.length * slices)


def test_a_dipped_rod_swings_slower_by_its_slices():
    submerged, density = 0.06, 1000.0
    dry = ROD.length - submerged
    lift, _ = quad(lambda x: x, dry, ROD.length)
    wet, _ = quad(lambda x: x**2, dry, ROD.length)
    per_length = density * np.pi * ROD.radius**2
    torque = 9.81 * (ROD.mass * ROD.length / 2 - per_length * lift)
    expected = 2 * np.pi * np.sqrt((ROD.inertia + per_length * wet) / torque)
    assert pendulum.period_in_liquid(ROD, submerged, density) == pytest.approx(expected)
    assert pendulum.period_in_liquid(ROD, 0.0, density) == pytest.approx(
        pendulum.period_in_air(0.0, ROD)
    )
    with pytest.raises(ValueError, match="floats"):
        pendulum.period_in_liquid(dataclasses.replace(ROD, mass=1e-4), submerged, density)


def test_added_mass_grows_as_the_walls_close_in():
    """The potential flow in an annulus; its kinetic energy integrated by SciPy."""
    inner, outer = 1.0, 2.5
    # phi = (A r + B/r) cos θ with phi_r = cos θ at the inner wall and 0 at the outer
    b = -(inner**2) * outer**2 / (outer**2 - inner**2)
    a = b / outer**2
    energy, _ = quad(
        lambda r: np.pi * r * ((a - b / r**2) ** 2 + (a + b / r**2) ** 2), inner, outer
    )
    assert pendulum.added_mass_coefficient(inner, outer) == pytest.approx(energy / np.pi)
    assert pendulum.added_mass_coefficient(inner) == 1.0
    assert pendulum.added_mass_coefficient(inner, 1e6) == pytest.approx(1.0)


def test_a_light_rod_floats_where_its_torque_vanishes_and_holds():
    light = dataclasses.replace(ROD, mass=0.3 * 1000 * ROD.area * ROD.length)
    angle = pendulum.floating_angle(light, 0.08, 1000.0)
    assert 0.1 < angle < 1.2
    around = pendulum.archimedes_torque(angle + np.array([-0.05, 0, 0.05]), light, 0.08, 1000.0)
    assert around[1] == pytest.approx(0.0, abs=1e-9)
    assert around[0] < 0 < around[2]
    # a heavy one, and one that hardly dips in, hang straight down
    assert pendulum.floating_angle(dataclasses.replace(ROD, mass=0.1), 0.08, 1000.0) == 0.0
    assert pendulum.floating_angle(light, 0.13, 1000.0) == 0.0


def test_the_torque_is_the_slope_of_the_potential_energy():
    """Of the rod's weight and of the liquid it lifts, slice by slice."""
    surface, density = 0.08, 1000.0

    def energy(angle):
        height, _ = quad(lambda x: -x * np.cos(angle), 0, ROD.length)
        dry = surface / np.cos(angle)
        lifted, _ = quad(lambda x: x * np.cos(angle) - surface, dry, ROD.length)
        return 9.81 * (ROD.mass / ROD.length * height + density * ROD.area * lifted)

    slope = (energy(0.4 + 1e-4) - energy(0.4 - 1e-4)) / 2e-4
    assert pendulum.archimedes_torque(0.4, ROD, surface, density) == pytest.approx(slope, rel=1e-6)


def test_the_frequency_of_a_column_is_that_of_its_energies():
    """Axes exp(±a), volume constant: kinetic energy π/4 ȧ², surface the ellipse's perimeter."""

    def perimeter(a):
        return 4.0 * np.exp(a) * ellipe(1.0 - np.exp(-4.0 * a))

    a = 1e-3
    stiffness = 2.0 * (perimeter(a) - perimeter(0.0)) / a**2
    expected = np.sqrt(stiffness / (0.5 * np.pi)) / (2.0 * np.pi)
    ours = surfaces.column_frequency(1.0, tension=1.0, density=1.0)
    assert ours == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("kinematic", [0.01, 0.3, 5.0])
def test_stokes_reaction_solves_the_oscillating_boundary_layer(kinematic):
    """A unit cylinder held in liquid that oscillates far away: ψ = (r + a/r + b w) sin θ.

    w'' + w'/r - w/r² = iω/ν w decays outwards; q = w'/w is integrated inwards. No slip gives
    a = (1 - q) / (1 + q), and pressure and friction add to -2 a of the displaced liquid's
    inertia, of which 1 is that of the liquid's own acceleration.
    """
    omega, far = 2.0, 12.0
    kappa = 1j * omega / kinematic

    def inwards(depth, q):
        r = far - depth
        return -(kappa + 1.0 / r**2 - q / r - q**2)

    start = np.array([-np.sqrt(kappa) - 0.5 / far])
    q = solve_ivp(inwards, (0, far - 1), start, method="BDF", rtol=1e-9, atol=1e-9).y[0, -1]
    reaction = -1.0 - 2.0 * (1.0 - q) / (1.0 + q)
    ours = oscillating_rod.stokes_reaction(1.0, omega, kinematic)
    assert ours.added_mass == pytest.approx(reaction.real, rel=1e-4)
    assert ours.damping == pytest.approx(-reaction.imag, rel=1e-4)


def test_a_swing_in_thin_liquid_is_that_of_potential_flow():
    """And its slight decay comes from a boundary layer: 2.83 / (r sqrt(ω/ν)) of added mass."""
    thin = oscillating_rod.swing_in_liquid(ROD, 0.06, density=1000.0, viscosity=1e-9)
    period = pendulum.period_in_liquid(ROD, 0.06, 1000.0)
    assert thin.period == pytest.approx(period, rel=1e-3)
    omega = 2 * np.pi / period
    layer = 2 * np.sqrt(2) / (ROD.radius * np.sqrt(omega / 1e-12))
    wet = 1000.0 * ROD.area * (ROD.length**3 - (ROD.length - 0.06) ** 3) / 3
    assert thin.decay == pytest.approx(0.5 * layer * wet * omega / (ROD.inertia + wet), rel=1e-2)
    thick = oscillating_rod.swing_in_liquid(ROD, 0.06, density=1000.0, viscosity=0.05)
    assert thick.period > thin.period and thick.decay > 10 * thin.decay
    cup = oscillating_rod.swing_in_liquid(
        ROD, 0.06, density=1000.0, viscosity=1e-9, outer_radius=0.02
    )
    assert cup.period > thin.period


def test_a_wide_cup_is_no_cup():
    radius, omega, kinematic = ROD.radius, 9.0, 1e-5
    cup = oscillating_rod.stokes_reaction_in_cup(radius, 200 * radius, omega, kinematic)
    np.testing.assert_allclose(
        cup, oscillating_rod.stokes_reaction(radius, omega, kinematic), rtol=1e-4
    )


def test_thin_liquid_in_a_cup_has_the_added_mass_of_potential_flow():
    """Apart from boundary layers, which take part of the gap at both walls."""
    radius, cup, omega = 0.005, 0.02, 9.0
    potential = pendulum.added_mass_coefficient(radius, cup)
    for kinematic, tolerance in ((1e-8, 2e-2), (1e-12, 2e-4)):
        reaction = oscillating_rod.stokes_reaction_in_cup(radius, cup, omega, kinematic)
        assert reaction.added_mass == pytest.approx(potential, rel=tolerance)
        assert 0.0 < reaction.damping < tolerance * potential


def test_thick_liquid_in_a_cup_drags_as_if_it_were_steady():
    """4 π μ U / (ln(R/r) - (R² - r²) / (R² + r²)), creeping flow between cylinders."""
    radius, cup, omega = 0.0045, 0.04, 9.0
    shape = np.log(cup / radius) - (cup**2 - radius**2) / (cup**2 + radius**2)
    for kinematic in (0.1, 1.0, 10.0):
        steady = 4.0 * kinematic / (shape * radius**2 * omega)
        reaction = oscillating_rod.stokes_reaction_in_cup(radius, cup, omega, kinematic)
        assert reaction.damping == pytest.approx(steady, rel=1e-5)
    with pytest.raises(ValueError, match="cup"):
        oscillating_rod.stokes_reaction_in_cup(cup, radius, omega, 1.0)
