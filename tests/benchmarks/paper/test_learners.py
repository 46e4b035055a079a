"""Stirring that ends early."""

import numpy as np
import pytest

from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.simulators import stir_simulator

from .learners import until_stroke


def test_stirring_that_ends_early_is_the_beginning_of_the_same_stirring():
    longer = until_stroke(bundled_recording("water"), 3)
    first = until_stroke(longer, 2)
    theta = {"viscosity": np.array([0.1]), "cohesion": np.array([0.3])}
    short, full = (
        stir_simulator([one], 0).simulate(theta, np.array([4])) for one in (first, longer)
    )
    assert short.shape[1] < full.shape[1]
    same = short.shape[1] - 3  # the curve through the samples bends by those that follow
    assert 20 < same < 60
    np.testing.assert_array_equal(short[0, :same], full[0, :same])


def test_a_stroke_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="stroke must be one of 0, 1, .*, got 40"):
        until_stroke(bundled_recording("water"), 40)
