"""Liquids that are given by numbers."""

import numpy as np
import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.described_liquid import Described, read_effects


@pytest.mark.parametrize(
    ("text", "scene", "named"),
    [
        ("warmth=1", "stir", "--effect warmth=1"),
        ("warming", "stir", "--effect warming="),
        ("adhesion=-3", "pour", "--effect adhesion=-3"),
        ("adhesion=0.3", "stir", "--effect adhesion=0.3"),  # which acts in pours alone
    ],
)
def test_bad_effects_are_named(text, scene, named):
    with pytest.raises(InputError) as refused:
        read_effects([text], scene)
    assert refused.value.where == named


def test_effects_are_read():
    read = read_effects(["warming=0.01", "adhesion = 0.3"], "pour")
    assert read == {"warming": 0.01, "adhesion": 0.3}
    with pytest.raises(InputError, match="given twice"):
        read_effects(["adhesion=0.3", "adhesion=0.3"], "pour")


@pytest.mark.parametrize(
    ("field", "value"),
    [("viscosity", -1.0), ("cohesion", np.nan), ("density", 0.0), ("particles", 3), ("seed", -1)],
)
def test_bad_liquids_are_named(field, value):
    fine = {"viscosity": 1.0, "cohesion": 0.2, "density": 1000.0, "particles": 300, "seed": 0}
    Described(**fine)
    with pytest.raises(InputError) as refused:
        Described(**{**fine, field: value})
    assert refused.value.where == field
