"""What a flat floor leaves open of cells and faces, against analytic values."""

import numpy as np
import pytest
from bolfi_liquids.models.apic.geometry import SAMPLES, sample_geometry
from bolfi_liquids.models.apic.grid import Grid

CELL = 0.005
FLOOR = 0.3  # cells from the lower faces of a layer of cells
WITHIN = 0.5 / SAMPLES + 1e-6  # shares are means over samples
LAYERS = (-1, 0, 1)  # that of cells below, that of the cut ones, that above
GRID = Grid.around_cup(CELL, 0.02, 0.03)


@pytest.fixture(scope="module")
def geometry():
    return sample_geometry(GRID, lambda x, y, z: z - FLOOR * CELL)


def in_layers(field):
    """The values of a column of cells in `LAYERS`."""
    nx, ny, nz = GRID.shape
    column = field.reshape(nz, ny, nx)[:, ny // 2, nx // 2]
    lowest = round(-GRID.origin[2] / CELL)
    return column[[lowest + layer for layer in LAYERS]]


def hat_above(distance):
    """Share of a hat's weight that lies beyond a distance from its middle, in cells."""
    outside = 0.5 * (1.0 - min(abs(distance), 1.0)) ** 2
    return outside if distance > 0.0 else 1.0 - outside


def test_the_volume_is_the_open_share_of_the_cell(geometry):
    np.testing.assert_allclose(in_layers(geometry.volume), [0.0, 1.0 - FLOOR, 1.0], atol=WITHIN)


def test_the_capacity_is_what_full_liquid_deposits(geometry):
    middles = np.array(LAYERS) + 0.5
    expected = [hat_above(FLOOR - middle) for middle in middles]
    assert expected[0] < 0.05 and expected[1] == pytest.approx(0.68)
    np.testing.assert_allclose(in_layers(geometry.capacity), expected, atol=WITHIN)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_area_is_the_open_share_of_the_face(geometry, axis):
    np.testing.assert_allclose(in_layers(geometry.area[axis]), [0.0, 1.0 - FLOOR, 1.0], atol=WITHIN)
    np.testing.assert_array_equal(in_layers(geometry.area[2]), [0.0, 0.0, 1.0])


def test_solid_is_the_wall_s_share_weighted_as_particles_deposit(geometry):
    upright, flat = np.array(LAYERS) + 0.5, np.array(LAYERS)
    for axis, middles in ((0, upright), (1, upright), (2, flat)):
        expected = [1.0 - hat_above(FLOOR - middle) for middle in middles]
        np.testing.assert_allclose(in_layers(geometry.solid[axis]), expected, atol=WITHIN)


def test_edge_is_the_open_share_of_the_box_around_it(geometry):
    """Boxes around flat edges lie half a cell lower than those around upright ones."""
    for axis in (0, 1):
        expected = [0.0, 0.5 - FLOOR, 1.0]
        np.testing.assert_allclose(in_layers(geometry.edge[axis]), expected, atol=WITHIN)
    np.testing.assert_allclose(in_layers(geometry.edge[2]), [0.0, 1.0 - FLOOR, 1.0], atol=WITHIN)
