"""The boundary integrals against sums over explicit virtual particles."""

import numpy as np
import pytest
from bolfi_liquids.models.fluid import wall_tables

STEP = 1.0 / 32.0
AXIS = (np.arange(-64, 64) + 0.5) * STEP


def summed(inside, distance):
    """Density and viscous couplings of virtual liquid where `inside`, seen from x = distance."""
    x, y, z = np.meshgrid(AXIS, AXIS, AXIS, indexing="ij", sparse=True)
    r = np.sqrt((x - distance) ** 2 + y**2 + z**2)
    there = inside(x, y) & (r < 1.0)
    slope = np.where(there, wall_tables.wendland_slope(r), 0.0) * STEP**3
    cos2 = np.where(there, (x - distance) ** 2 / np.maximum(r, 1e-9) ** 2, 0.0)
    return (
        np.sum(np.where(there, wall_tables.wendland(r), 0.0)) * STEP**3,
        np.sum(slope * cos2),
        np.sum(slope * (1.0 - cos2)) / 2.0,
    )


def at(table, distance):
    grid = np.linspace(0.0, 1.0, wall_tables.ENTRIES)
    return [np.interp(distance, grid, c) for c in (table.density, table.normal, table.tangential)]


@pytest.mark.parametrize("distance", [0.125, 0.25, 0.5, 0.75])
def test_half_space_is_a_sum_over_the_half_space(distance):
    expected = summed(lambda x, y: (x < 0) & (y == y), distance)
    assert at(wall_tables.half_space(), distance) == pytest.approx(expected, rel=0.02, abs=1e-4)


@pytest.mark.parametrize("distance", [0.125, 0.25, 0.5])
def test_cylinder_is_a_sum_over_the_cylinder(distance):
    radius = 0.375
    expected = summed(lambda x, y: (x + radius) ** 2 + y**2 < radius**2, distance)
    assert at(wall_tables.cylinder(radius), distance) == pytest.approx(expected, rel=0.05, abs=2e-3)


def test_kernel_integrates_to_one():
    r = np.linspace(0.0, 1.0, 4001)
    assert np.trapezoid(4.0 * np.pi * r**2 * wall_tables.wendland(r), r) == pytest.approx(
        1.0, abs=1e-6
    )


@pytest.mark.parametrize("table", [wall_tables.half_space(), wall_tables.cylinder(0.35)])
def test_gradient_is_the_slope_of_the_density(table):
    grid = np.linspace(0.0, 1.0, wall_tables.ENTRIES)
    risen = np.concatenate(
        [[0.0], np.cumsum((table.gradient[1:] + table.gradient[:-1]) / 2 * np.diff(grid))]
    )
    assert table.density[0] + risen == pytest.approx(table.density, abs=2e-3)
    assert table.density[-1] == pytest.approx(0.0, abs=1e-9)


def test_half_space_holds_half_at_its_surface():
    assert wall_tables.half_space().density[0] == pytest.approx(0.5, abs=1e-4)


def test_a_wide_cylinder_is_a_half_space():
    """From below: a convex surface leaves room beside it that a plane fills."""
    plane = wall_tables.half_space().density
    short = [np.max(plane - wall_tables.cylinder(radius).density) for radius in (0.5, 1.0, 2.0)]
    assert np.all(np.diff(short) < 0)
    assert short[-1] < 0.05
