"""Boxes of liquid: what they hold, and that they say so when it is too much."""

from functools import cache

import numpy as np
import pytest
from scenes import wet_box
from scenes.wet_box import Body, WetBox, WetLiquid, flow_in_box

BOX = WetBox((0.04, 0.0, 0.04), block=((0.012, 0.0, 0.008), (0.02, 0.0, 1.0)))


@pytest.mark.parametrize("flat", [True, False])
def test_a_block_fills_its_cells_alike_with_four_particles_each(flat):
    box = WetBox((0.016, 0.016, 0.016), flat=flat)
    points = box.fill(((0.0, 0.0, 0.0), (0.016, 0.016, 0.012)), 0)
    cell = np.floor(points / box.cell).astype(int)
    _, counts = np.unique(cell, axis=0, return_counts=True)
    assert len(counts) == (12 if flat else 48) and (counts == 4).all()


def test_distances_are_those_from_the_nearest_of_sides_and_block():
    x = np.array([0.002, 0.011, 0.016, 0.023, 0.009])
    z = np.array([0.030, 0.030, 0.030, 0.039, 0.004])
    expected = [0.002, 0.001, -0.004, 0.001, 0.004]
    np.testing.assert_allclose(BOX.distance(x, np.zeros(5), z), expected, atol=1e-12)


def test_nothing_flows_along_y_in_a_flat_box():
    geometry = BOX.geometry()
    assert geometry.usable.sum() == 10 * 10 - 2 * 8  # cells that are not the block's
    assert (geometry.area[1] == 0.0).all() and (geometry.carries[1] == 0.0).all()


def test_too_large_a_box_says_what_room_there_is():
    box = WetBox((0.3, 0.0, 0.3))
    body = Body(box.fill(((0.0, 0.0, 0.0), (0.01, 0.0, 0.01)), 0), 1e-6)
    with pytest.raises(ValueError, match="room for 20000 cells and 8000 particles, got"):
        flow_in_box(box, [WetLiquid(0.001)], [body], 0.01, lambda x, v: 0.0)


def columns(seed):
    """Two joined columns, at one level."""
    parts = (((0, 0, 0), (0.04, 0, 0.008)), ((0, 0, 0.008), (0.012, 0, 0.024)))
    parts += (((0.02, 0, 0.008), (0.04, 0, 0.024)),)
    points = np.concatenate([BOX.fill(part, seed) for part in parts])
    return Body(points, (0.04 * 0.008 + 0.032 * 0.016) * BOX.cell)


def look(position, velocity):
    return [np.sqrt(np.mean(velocity**2)), *position.mean(axis=0)]


def test_liquid_at_rest_in_two_joined_columns_stays_level():
    """Within a tenth of a cell: cells at the surface may hold less than their fill."""
    body = columns(0)
    _, seen = flow_in_box(BOX, [WetLiquid(0.1)], [body], 1.0, look)
    assert seen[-1, 0, 0] < 1e-3  # m/s
    np.testing.assert_allclose(seen[-1, 0, 1:], body.points.mean(axis=0), atol=0.1 * BOX.cell)


def test_what_flowed_before_changes_no_bit():
    wet, body = WetLiquid(0.01, 1000.0, 0.072, np.radians(60.0)), columns(0)
    above = BOX.fill(((0.02, 0.0, 0.02), (0.04, 0.0, 0.04)), 1)
    splash = Body(above, 0.02 * 0.02 * BOX.cell, (-0.5, 0.0, 0.5))
    _, first = flow_in_box(BOX, [wet], [body], 0.3, look)
    flow_in_box(BOX, [wet._replace(viscosity=1.0)], [splash], 0.1, look)
    _, again = flow_in_box(BOX, [wet], [body], 0.3, look)
    np.testing.assert_array_equal(first, again)


def test_more_boxes_than_march_at_a_time_take_turns(monkeypatch):
    from bolfi_liquids.models.apic.lanes import LANES

    monkeypatch.setattr(wet_box, "GROUPS", 1)
    monkeypatch.setattr(wet_box, "_scene", cache(wet_box._scene.__wrapped__))
    liquids = [WetLiquid(10.0 ** -(2 + n % 2)) for n in range(LANES + 1)]
    bodies = [columns(n) for n in range(LANES + 1)]
    _, seen = flow_in_box(BOX, liquids, bodies, 0.02, look)
    for n in (0, LANES - 1, LANES):
        _, alone = flow_in_box(BOX, liquids[n : n + 1], bodies[n : n + 1], 0.02, look)
        np.testing.assert_array_equal(seen[:, n], alone[:, 0])
