"""Where particles start."""

import numpy as np
import pytest
from bolfi_liquids.models.apic.filling import fill_cup
from bolfi_liquids.models.apic.grid import Grid

RADIUS = 0.04
GRID = Grid.around_cup(0.005, RADIUS, 0.05)


def test_an_empty_cup_has_no_particles():
    assert fill_cup(GRID, RADIUS, 0.0, 2, 0).shape == (0, 3)


@pytest.mark.parametrize("fill", [0.05, 0.041])
def test_particles_fill_the_cup_to_its_level_alike(fill):
    points = fill_cup(GRID, RADIUS, fill, 2, 0)
    assert np.hypot(points[:, 0], points[:, 1]).max() < RADIUS
    assert 0.0 < points[:, 2].min() and points[:, 2].max() < fill + 0.001
    assert points[:, 2].mean() == pytest.approx(0.5 * fill, rel=2e-3)
    each = np.pi * RADIUS**2 * fill / len(points)
    assert each == pytest.approx(0.5 * GRID.cell**3, rel=0.03)
