"""Minima over boxes, against closed forms."""

import numpy as np
import pytest
from bolfi_liquids.inference.gp.optimise import minimise_in_box

CENTRE = np.array([0.7, 0.2])


def bowl(u):
    return np.sum((u - CENTRE) ** 2, axis=1)


def wells(u):
    """Two minima of each coordinate, that nearer to the centre the deeper."""
    return np.sum(np.cos(4.0 * np.pi * u) + np.abs(u - CENTRE), axis=1)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 1.0, CENTRE),
        ([0.1, 0.1], [0.5, 0.9], [0.5, 0.2]),
        ([0.8, 0.3], [0.9, 0.4], [0.8, 0.3]),
    ],
    ids=["inside", "one wall", "a corner"],
)
def test_the_least_value_in_a_box_is_found(low, high, expected):
    found = minimise_in_box(bowl, 2, np.array(low), np.array(high))
    np.testing.assert_allclose(found, expected, atol=1e-3)


def test_a_deeper_well_outside_of_the_box_is_left_alone():
    everywhere = minimise_in_box(wells, 2)
    boxed = minimise_in_box(wells, 2, np.zeros(2), np.array([0.5, 1.0]))
    assert everywhere[0] == pytest.approx(0.75, abs=0.05)
    assert boxed[0] == pytest.approx(0.25, abs=0.05)
    assert boxed[1] == pytest.approx(everywhere[1], abs=1e-3)
