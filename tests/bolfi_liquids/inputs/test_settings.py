"""Settings are checked when they are made, and a refusal names option and value."""

import pickle
from dataclasses import asdict, replace

import numpy as np
import pytest
from bolfi_liquids.inference.bolfi import MOST_SIMULATIONS
from xarray import DataArray

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.described_liquid import check_effects
from bolfi_liquids.inputs.limits import checked_number
from bolfi_liquids.inputs.settings import (
    MAX_SIMULATIONS,
    MIN_SIMULATIONS,
    CalibrationSettings,
    CriticismSettings,
    PourSettings,
    SbcSettings,
)
from bolfi_liquids.online.settings import OnlineSettings


@pytest.mark.parametrize(
    ("kind", "where", "name", "value"),
    [
        (CalibrationSettings, "budget", "budget", MIN_SIMULATIONS - 1),
        (CalibrationSettings, "particles", "particles", 99),
        (CalibrationSettings, "seed", "seed", True),
        (CalibrationSettings, "seed", "seed", np.float64(3.0)),
        (CalibrationSettings, "chains", "chains", 1),
        (CalibrationSettings, "sampler", "sampler", "gibbs"),
        (CriticismSettings, "effects", "effects", (1,)),
        (SbcSettings, "noise_deg", "noise_deg", float("nan")),
        (OnlineSettings, "online setting target", "target", 1.0),
    ],
)
def test_a_value_that_breaks_a_rule_is_named(kind, where, name, value):
    with pytest.raises(InputError) as refused:
        kind(**{name: value})
    assert (refused.value.where, refused.value.what) == (where, repr(value))
    assert refused.value.fix


def test_limits_themselves_are_allowed_and_end_where_the_engine_does():
    assert MAX_SIMULATIONS == MOST_SIMULATIONS
    for budget in (MIN_SIMULATIONS, MAX_SIMULATIONS):
        assert CalibrationSettings(budget=budget, particles=100).budget == budget
    with pytest.raises(InputError, match="^design: "):
        SbcSettings(design=MIN_SIMULATIONS)
    with pytest.raises(InputError, match="^budgett: "):
        CalibrationSettings(**{"budgett": 20})
    with pytest.raises(TypeError, match="takes"):
        PourSettings(*range(9))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("kind", [np.int64, np.uint8])
def test_integers_of_numpy_become_pythons_own(kind):
    numbers = {"budget": 9, "batch": 2, "seed": 3, "particles": 200, "chains": 2, "draws": 50}
    settings = CalibrationSettings(**{name: kind(value) for name, value in numbers.items()})
    assert settings == CalibrationSettings(**numbers)
    assert {type(getattr(settings, name)) for name in numbers} == {int}


def test_settings_are_plain_values():
    settings = CalibrationSettings(seed=4)
    assert asdict(settings)["seed"] == 4
    assert pickle.loads(pickle.dumps(settings)) == settings
    with pytest.raises(InputError, match="^seed: "):
        replace(settings, seed=-1)
    named = CriticismSettings(effects=("a", "b", "a"), accept=("b", "b"))
    assert (named.effects, named.accept) == (("a", "b"), ("b",))


@pytest.mark.parametrize("number", [np.float32(0.1), DataArray(0.1)])
def test_a_number_may_be_an_array_without_axes(number):
    assert checked_number(number, "a") == check_effects({"adhesion": number}, "pour")["adhesion"]
    assert type(checked_number(number, "a")) is float


@pytest.mark.parametrize("other", [True, "0.1", np.array([0.1]), np.nan])
def test_what_is_no_number_is_refused(other):
    with pytest.raises(InputError, match="^a: .*give one finite number"):
        checked_number(other, "a")
    with pytest.raises(InputError, match="^--effect adhesion=.*give adhesion=NUMBER"):
        check_effects({"adhesion": other}, "pour")


@pytest.mark.parametrize(
    ("effects", "scene", "said"),
    [
        ({"adhesion": 1e9}, "pour", "adhesion=1e+09"),
        ({"adhesion": 0.1}, "stir", "does not act in a stir"),
        ({"adhesoin": 0.1}, "pour", "unknown"),
        ([("adhesion", 0.1)], "pour", "effects"),
    ],
)
def test_an_effect_that_cannot_act_is_refused(effects, scene, said):
    with pytest.raises(InputError) as refused:
        check_effects(effects, scene)
    assert said in str(refused.value)
