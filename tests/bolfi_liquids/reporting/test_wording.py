"""Names, numbers and paragraphs."""

import pytest
from jinja2 import UndefinedError

from bolfi_liquids.pouring.parcels import PARCELS
from bolfi_liquids.reporting.prose import prose
from bolfi_liquids.wording import LEAST_SPILLED, degrees, percent, spilled, with_unit


def test_a_fact_or_a_chapter_that_is_missing_is_refused():
    with pytest.raises(UndefinedError, match="simulations"):
        prose("effort", {"calibration": {}})
    with pytest.raises(KeyError, match="criticism"):
        prose("verdict", {"calibration": {}})


def test_blank_lines_separate_paragraphs_of_single_spaces():
    parameter = {"name": "viscosity", "low": "1", "median": "2", "high": "3", "share": "4 %"}
    both = [parameter | {"learned": learned, "at_end": False} for learned in (True, False)]
    paragraphs = prose("liquid", {"calibration": {"parameters": both}})
    assert len(paragraphs) == 2
    assert all(one == " ".join(one.split()) and one.endswith(".") for one in paragraphs)


def test_numbers_carry_their_units():
    assert with_unit("viscosity", 0.12345) == "0.123 Pa s"
    assert with_unit("camera_delay", 0.05) == "0.05 s"
    assert with_unit("cohesion", 0.5) == "0.5"
    assert degrees(1.005001) == "1.01°"
    assert percent(0.0034) == "0.34 %" and percent(0.123) == "12 %" and percent(1.0) == "100 %"
    # less than half a parcel of the map is not told apart
    assert LEAST_SPILLED == 0.5 / PARCELS
    assert spilled(0.0) == spilled(0.99 * LEAST_SPILLED) != spilled(LEAST_SPILLED)
    assert spilled(0.03) == percent(0.03)
