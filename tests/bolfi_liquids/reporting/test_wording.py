"""Every sentence has a wording, and every wording a sentence."""

import ast
import re
from importlib.resources import files
from pathlib import Path

import pytest
from jinja2 import Environment, UndefinedError, nodes

import bolfi_liquids
from bolfi_liquids.pouring.parcels import PARCELS
from bolfi_liquids.wording import (
    LEAST_SPILLED,
    listed,
    percent,
    sentence,
    spilled,
    with_unit,
    wordings,
)

HOME = Path(bolfi_liquids.__file__).parent
TEMPLATES = {
    path.name.removesuffix("_sentences.jinja"): path.read_text(encoding="utf-8")
    for path in Path(str(files("bolfi_liquids.data"))).glob("*_sentences.jinja")
}
KEY = re.compile(rf"({'|'.join(TEMPLATES)})\.(?!nc$)[a-z_]+")


def keys_in_the_source():
    """Texts that look like the key of a sentence."""
    for path in HOME.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                if KEY.fullmatch(node.value):
                    yield node.value


def macros():
    """Key -> names of the other macros of its subject that its wording uses."""
    for subject, text in TEMPLATES.items():
        tree = Environment(autoescape=False).parse(text)
        for macro in tree.find_all(nodes.Macro):
            used = {name.name for name in macro.find_all(nodes.Name)}
            yield f"{subject}.{macro.name}", {f"{subject}.{name}" for name in used}


def test_every_key_has_a_wording_and_every_wording_is_used():
    found = dict(macros())
    asked = set(keys_in_the_source())
    assert asked <= set(found)
    within = set().union(*found.values())
    assert set(found) <= asked | within
    for key in asked:
        subject, _, name = key.partition(".")
        assert callable(getattr(wordings(subject), name))


def test_a_value_that_is_missing_or_unknown_is_refused():
    with pytest.raises(UndefinedError):
        str(sentence("warning.no_search", total=20))
    with pytest.raises(TypeError, match="shown"):
        str(sentence("warning.not_criticised", shown=1))


def test_numbers_carry_their_units():
    assert with_unit("viscosity", 0.12345) == "0.123 Pa s"
    assert with_unit("camera_delay", 0.05) == "0.05 s"
    assert with_unit("cohesion", 0.5) == "0.5"
    assert percent(0.0034) == "0.34 %" and percent(0.123) == "12 %"


@pytest.mark.parametrize(
    ("names", "expected"),
    [(("a",), "a"), (("a", "b_c"), "a and b c"), (("a", "b", "c"), "a, b and c")],
)
def test_names_are_listed(names, expected):
    assert listed(names) == expected


def test_less_than_half_a_parcel_is_not_told_apart():
    assert LEAST_SPILLED == 0.5 / PARCELS
    assert spilled(0.0) == spilled(0.99 * LEAST_SPILLED) != spilled(LEAST_SPILLED)
    assert spilled(0.03) == percent(0.03)
