"""What a round wall does to liquid that turns in it, by the arrays of the geometry alone."""

import numpy as np
import pytest
from bolfi_liquids.models.apic.geometry import NEAREST, sample_geometry
from bolfi_liquids.models.apic.grid import Grid

CELL = 0.005


@pytest.mark.parametrize("radius", [0.04, 0.0415, 0.043])
def test_all_of_a_round_wall_rubs_at_liquid_that_turns(radius):
    """Each component has its share of the wall; together they have a layer's circumference."""
    grid = Grid.around_cup(CELL, radius, 0.05)

    def distance(x, y, z):
        return radius - np.hypot(x, y)

    geometry = sample_geometry(grid, distance)
    layer = np.arange(grid.cells) // grid.strides[2] == grid.shape[2] // 2
    found = 0.0
    for axis in range(2):
        faces = grid.faces(axis)[layer]
        area = geometry.friction[axis][layer] * np.maximum(distance(*faces.T) / CELL, NEAREST)
        across = faces[:, 1 - axis] / np.hypot(faces[:, 0], faces[:, 1])
        found += (area * across**2).sum()
    assert found == pytest.approx(2.0 * np.pi * radius / CELL, rel=0.01)


def test_a_flat_floor_rubs_at_the_faces_above_it():
    grid = Grid.around_cup(CELL, 0.04, 0.05)
    geometry = sample_geometry(grid, lambda x, y, z: z)
    faces = grid.faces(0)
    lowest = grid.inner() & (np.abs(faces[:, 2] - 0.5 * CELL) < 1e-9)
    np.testing.assert_allclose(geometry.friction[0][lowest], 1.0 / 0.5, rtol=1e-6)
    above = grid.inner() & (faces[:, 2] > CELL)
    assert not geometry.friction[:2, above].any() and not geometry.friction[2, above].any()
