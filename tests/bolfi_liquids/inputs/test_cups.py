"""Cups that nobody pours with are refused when they are given, and read where a run holds them."""

from importlib.resources import files

import pytest

import bolfi_liquids as bl
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.cups import bundled_cups, cups_of, kept_cups

ODD = {
    "pour.final_angle_deg": 13.5,  # the surface does not reach the lip
    "pour.lip_height": 2.0,
    "source.height": 0.6,
    "receiver.radius": 0.0035,
}


def with_value(name, value):
    part, field = name.split(".")
    settings = bundled_cups().model_dump()
    settings[part][field] = value
    if name == "source.height":
        settings["pour"]["lip_height"] = 0.9
    return bl.Cups.model_validate(settings)


@pytest.mark.parametrize("name", ODD)
def test_cups_that_nobody_pours_with_are_refused(name):
    cups = with_value(name, ODD[name])
    field = name.rpartition(".")[2]
    with pytest.raises(InputError, match=rf"^cups: (\w+\.)?{field} = {ODD[name]:g}"):
        cups_of(cups)
    assert kept_cups(cups.settings()) == cups  # a finished pour over them can be read


@pytest.mark.parametrize(
    ("right", "wrong", "likely"),
    [("[receiver]", "[reciever]", "receiver"), ("lip_height", "lip_hight", "lip_height")],
)
def test_an_unknown_key_is_named_with_the_likeliest(tmp_path, right, wrong, likely):
    text = (files("bolfi_liquids.data") / "cups.toml").read_text(encoding="utf-8")
    (tmp_path / "cups.toml").write_text(text.replace(right, wrong), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        cups_of(tmp_path / "cups.toml")
    assert wrong.strip("[]") in refused.value.where and likely in refused.value.fix


def test_the_bundled_cups_can_be_poured_with():
    assert cups_of(bundled_cups()) == cups_of(None)
