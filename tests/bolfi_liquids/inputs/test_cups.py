"""Cups that nobody pours with are refused when they are given."""

from importlib.resources import files

import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.cups import bundled_cups, cups_of, kept_cups

ODD = {
    "pour.final_angle_deg": 13.5,  # the surface does not reach the lip
    "pour.lip_height": 2.0,
    "source.height": 0.6,
    "receiver.radius": 0.0035,
}


def with_value(name, value):
    """The bundled cups with another value, which a copy does not check."""
    part, field = name.split(".")
    cups = bundled_cups()
    section = getattr(cups, part).model_copy(update={field: value})
    return cups.model_copy(update={part: section})


@pytest.mark.parametrize("name", ODD)
def test_cups_that_nobody_pours_with_are_refused(name):
    with pytest.raises(InputError, match=rf"^cups: {name}.* {ODD[name]:g}"):
        cups_of(with_value(name, ODD[name]))


def test_the_cups_of_a_result_are_those_it_was_made_with():
    assert kept_cups(bundled_cups().settings()) == bundled_cups()


@pytest.mark.parametrize(
    ("right", "wrong", "likely"),
    [
        ("[receiver]", "[reciever]", "receiver"),
        ("lip_height", "lip_hight", "lip_height"),
        ("lip_height", "radius", "compare with"),  # a field of other tables
    ],
)
def test_an_unknown_key_is_named_with_the_likeliest(tmp_path, right, wrong, likely):
    text = (files("bolfi_liquids.data") / "cups.toml").read_text(encoding="utf-8")
    (tmp_path / "cups.toml").write_text(text.replace(right, wrong), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        cups_of(tmp_path / "cups.toml")
    assert wrong.strip("[]") in refused.value.where and likely in refused.value.fix


def test_the_bundled_cups_can_be_poured_with():
    assert cups_of(bundled_cups()) == cups_of(None)
