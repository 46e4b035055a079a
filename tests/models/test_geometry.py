"""What a flat floor and a cup's thin wall leave of cells and faces, against analytic values."""

import numpy as np
import pytest
from bolfi_liquids.models.apic.geometry import INSIDE, OUTSIDE, SAMPLES, sample_geometry
from bolfi_liquids.models.apic.grid import Grid
from bolfi_liquids.models.pours.vessel import RIM, Vessel

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


RADIUS = 0.028
THIN = [0.005, 0.0033]  # m, cells of which a wall of 2 mm is 0.4 and 0.6


def of_half(vessel, axis):
    """Heights [m], sides of the wall and areas of wall, in cells, of the faces along an axis that
    belong to the simulated half of the cup; those in the mirror belong to both halves."""
    grid, geometry = vessel.grid(), vessel.geometry()
    _, y, z = grid.faces(axis).T
    share = np.where(np.abs(y) < 1e-9, 0.5, 1.0) * (y > -1e-9)
    return z, geometry.face_side[axis], share * geometry.wall[axis]


@pytest.mark.parametrize("cell", THIN)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_thin_wall_has_its_whole_area_on_either_side(cell, axis):
    """Half a circumference, all of which goes along z, and half of it along x and along y.

    A wall that counted on its other side too would change a sum by as much as the two differ, 7 %.
    """
    z, side, wall = of_half(Vessel(RADIUS, 0.06, 0.034, cell), axis)
    between = (-0.03 < z) & (z < -1.01 * cell)  # floor and rim
    layers = len(np.unique(np.round(z[between] / cell, 3)))
    along = 1.0 if axis == 2 else 0.5
    for kind, radius in ((INSIDE, RADIUS), (OUTSIDE, RADIUS + RIM)):
        ring = wall[between & (side == kind)].sum() / layers
        assert ring == pytest.approx(along * np.pi * radius / cell, rel=0.01)
    others = between & (side != INSIDE) & (side != OUTSIDE)
    assert (wall[others] == 0.0).all()


@pytest.mark.parametrize("cell", THIN)
@pytest.mark.parametrize("axis", [0, 1])
def test_a_thin_walls_rim_has_the_area_of_a_ring(cell, axis):
    """Its samples are mirrored in it, an eighth of a cell apart, so its edges are rounded."""
    z, _, wall = of_half(Vessel(RADIUS, 0.06, 0.034, cell), axis)
    ring = 0.5 * np.pi * ((RADIUS + RIM) ** 2 - RADIUS**2) / cell**2
    assert wall[z > 0.0].sum() == pytest.approx(ring, rel=0.05)
