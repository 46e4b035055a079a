"""Cups as they are given: a value, a file or none."""

import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.cups import bundled_cups, cups_of, kept_cups


def test_cups_are_given_as_they_are_or_not_at_all_and_come_back_from_a_result():
    bundled = bundled_cups()
    assert cups_of(bundled) == cups_of(None) == bundled
    assert kept_cups(bundled.settings()) == bundled
    with pytest.raises(InputError, match="^cups: 3 is no pair of cups; give a TOML file$"):
        cups_of(3)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("part", "field", "value"),
    [
        ("pour", "final_angle_deg", 13.5),
        ("pour", "lip_height", 2.0),
        ("receiver", "radius", 0.0035),
    ],
)
def test_a_copy_that_no_file_may_hold_is_refused(part, field, value):
    cups = bundled_cups()
    section = getattr(cups, part).model_copy(update={field: value})
    with pytest.raises(InputError, match=rf"^cups: .*{field}.* ?{value:g}"):
        cups_of(cups.model_copy(update={part: section}))
