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
    ("objective", "low", "high", "expected"),
    [
        (bowl, [0.0, 0.0], [1.0, 1.0], CENTRE),
        (bowl, [0.8, 0.1], [0.9, 0.4], [0.8, 0.2]),
        (wells, [0.0, 0.0], [0.5, 1.0], [0.25633, 0.24367]),  # a deeper well lies outside
    ],
    ids=["inside", "one wall", "outside"],
)
def test_the_least_value_in_a_box_is_found(objective, low, high, expected):
    found = minimise_in_box(objective, 2, np.array(low), np.array(high))
    np.testing.assert_allclose(found, expected, atol=1e-3)
