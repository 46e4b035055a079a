"""Surfaces at rest, against balances of force, integrals of their shape, and limits."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from truths import menisci, sessile_drops

WATER = np.sqrt(0.072 / (1000.0 * 9.81))  # m, its capillary length
ANGLES = np.radians([10.0, 60.0, 85.0, 110.0, 160.0])


def test_a_capillary_of_known_size():
    """Between plates 1 mm apart that it wets fully, water rises by 15 mm; mercury sinks."""
    assert 1e3 * menisci.mean_rise(1e-3, 0.0, WATER) == pytest.approx(14.68, abs=0.01)
    mercury = np.sqrt(0.485 / (13534.0 * 9.81))
    assert menisci.mean_rise(1e-3, np.radians(140.0), mercury) < 0.0


def surface(gap, angle):
    """The Young-Laplace equation as a boundary value problem: z and its slope from the middle."""
    x = np.linspace(0.0, 0.5 * gap, 200)

    def bend(_, state):
        z, slope = state
        return np.vstack([slope, z / WATER**2 * (1.0 + slope**2) ** 1.5])

    def ends(middle, wall):
        return np.array([middle[1], wall[1] - 1.0 / np.tan(angle)])

    begun = np.vstack([np.full_like(x, menisci.mean_rise(gap, angle, WATER)), 0.0 * x])
    solved = solve_bvp(bend, ends, x, begun, tol=1e-8, max_nodes=20000)
    assert solved.success
    return solved


@pytest.mark.parametrize("angle", np.radians([45.0, 60.0, 85.0, 110.0]))
@pytest.mark.parametrize("gap", [2e-3, 8e-3, 30e-3])
def test_a_surface_between_walls_solves_its_equation(gap, angle):
    found = menisci.meniscus_between_walls(gap, angle, WATER)
    solved = surface(gap, angle)
    assert found.middle == pytest.approx(solved.sol(0.0)[0], rel=1e-4, abs=1e-8)
    assert found.wall == pytest.approx(solved.sol(0.5 * gap)[0], rel=1e-4)
    fine = np.linspace(0.0, 0.5 * gap, 5001)
    mean = np.trapezoid(solved.sol(fine)[0], fine) / (0.5 * gap)
    assert mean == pytest.approx(menisci.mean_rise(gap, angle, WATER), rel=1e-4)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_wide_gap_has_two_lone_walls_and_a_narrow_one_an_arc(angle):
    """At a lone wall the pressure missing above the level, ρ g h² / 2, is σ (1 - sin a)."""
    wide = menisci.meniscus_between_walls(0.1, angle, WATER)
    lone = np.sign(np.cos(angle)) * np.sqrt(2.0 * 0.072 / (1000.0 * 9.81) * (1.0 - np.sin(angle)))
    assert wide.wall == pytest.approx(lone, rel=1e-6)
    assert abs(wide.middle) < 1e-9
    gap = 1e-4
    narrow = menisci.meniscus_between_walls(gap, angle, WATER)
    arc = 0.5 * gap / np.cos(angle) * (1.0 - np.sin(angle))
    assert narrow.wall - narrow.middle == pytest.approx(arc, rel=1e-3)
    assert narrow.middle == pytest.approx(menisci.mean_rise(gap, angle, WATER), rel=2e-3)


def test_a_wall_at_right_angles_raises_nothing():
    assert menisci.meniscus_between_walls(0.01, 0.5 * np.pi, WATER) == (0.0, 0.0)


@pytest.mark.parametrize("angle", np.radians([30.0, 90.0, 140.0]))
def test_half_a_ridge_is_below_its_height_and_half_within_its_width(angle):
    """By points in a circle above the floor, of which there are some 50 thousand: 0.5 %."""
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (200_000, 2))
    points[:, 1] -= np.cos(angle)
    within = np.hypot(points[:, 0], points[:, 1] + np.cos(angle)) < 1.0
    x, z = points[within & (points[:, 1] > 0.0)].T
    ridge = sessile_drops.cylindrical_cap(angle - 0.5 * np.sin(2.0 * angle), angle)
    assert ridge.height == pytest.approx(np.median(z), rel=0.03)
    assert ridge.width == pytest.approx(np.median(np.abs(x)), rel=0.03)
