"""Rows, results, and their output."""

import numpy as np
import pytest
from case import Row


def test_errors_are_relative_or_absolute():
    assert Row.relative("g", 9.81, 10.0, 0.02).error == pytest.approx(0.0194, abs=1e-4)
    assert Row.absolute("g", 0.0, -0.3, 0.2).error == -0.3
    assert not Row.absolute("g", 0.0, -0.3, 0.2).passed
    with pytest.raises(ValueError, match="no relative error"):
        Row.relative("g", 0.0, 1.0, 0.1)


def test_what_is_no_number_fails():
    assert not Row.absolute("g", 1.0, np.nan, 1e9).passed
    assert not Row.absolute("g", 1.0, np.inf, 1e9).passed
