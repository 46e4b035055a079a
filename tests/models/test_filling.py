"""Where particles start."""

import numpy as np
import pytest
from bolfi_liquids.models.apic.filling import POINTS, Cylinder, fill_cup
from bolfi_liquids.models.apic.grid import Grid

from bolfi_liquids import models

RADIUS = 0.04
GRID = Grid.around_cup(0.005, RADIUS, 0.055)


def test_an_empty_cup_has_no_particles():
    assert fill_cup(GRID, Cylinder(RADIUS), 0.0, 2, 0).shape == (0, 3)


@pytest.mark.parametrize("per_cell", POINTS)
@pytest.mark.parametrize("fill", [0.05, 0.041, 0.0525])
def test_particles_fill_the_cup_to_its_level_alike(fill, per_cell):
    points = fill_cup(GRID, Cylinder(RADIUS), fill, per_cell, 0)
    assert np.hypot(points[:, 0], points[:, 1]).max() < RADIUS
    assert 0.0 < points[:, 2].min() and points[:, 2].max() < fill + 0.001
    assert points[:, 2].mean() == pytest.approx(0.5 * fill, rel=2e-3)
    each = np.pi * RADIUS**2 * fill / len(points)
    assert each == pytest.approx(GRID.cell**3 / per_cell, rel=0.03)


@pytest.mark.parametrize("per_cell", [1, 3, 8])
def test_other_numbers_a_cell_are_refused(per_cell):
    with pytest.raises(ValueError, match=f"per_cell must be 2 or 4, got {per_cell}; take 2"):
        models.Numerics(per_cell=per_cell)
