"""Settings are checked when they are made, and a refusal names option and value."""

import pickle
from dataclasses import asdict, replace

import numpy as np
import pytest
from bolfi_liquids.inference.bolfi import MOST_SIMULATIONS
from xarray import DataArray

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.described_liquid import check_effects
from bolfi_liquids.inputs.limits import number_of
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
        (CalibrationSettings, "budget", "budget", 10**9),
        (CalibrationSettings, "particles", "particles", 10**9),
        (PourSettings, "iterations", "iterations", 10**9),
        (CalibrationSettings, "seed", "seed", 1.5),
        (CalibrationSettings, "seed", "seed", True),
        (CalibrationSettings, "chains", "chains", 1),
        (CalibrationSettings, "sampler", "sampler", "gibbs"),
        (PourSettings, "risk", "risk", "worst"),
        (PourSettings, "draws", "draws", "16"),
        (CriticismSettings, "seed", "seed", -1),
        (SbcSettings, "noise_deg", "noise_deg", float("nan")),
        (OnlineSettings, "online setting target", "target", 1.0),
        (OnlineSettings, "online setting least_strokes", "least_strokes", 0),
    ],
)
def test_a_value_that_breaks_a_rule_is_named(kind, where, name, value):
    with pytest.raises(InputError) as refused:
        kind(**{name: value})
    assert (refused.value.where, refused.value.what) == (where, repr(value))
    assert refused.value.fix


def test_a_budget_ends_where_the_engine_does():
    assert MAX_SIMULATIONS == MOST_SIMULATIONS


@pytest.mark.parametrize("kind", [np.int64, np.uint8, np.int32])
def test_integers_of_numpy_become_pythons_own(kind):
    settings = CalibrationSettings(
        budget=kind(9),
        batch=kind(2),
        seed=kind(3),
        particles=kind(200),
        chains=kind(2),
        draws=kind(50),
    )
    assert settings == CalibrationSettings(
        budget=9, batch=2, seed=3, particles=200, chains=2, draws=50
    )
    assert {type(value) for value in asdict(settings).values()} == {int, str}
    assert type(PourSettings(draws=kind(4)).draws) is int


@pytest.mark.parametrize("value", [np.bool_(True), np.float64(3.0), np.array([1, 2])])
def test_what_is_no_integer_is_refused(value):
    with pytest.raises(InputError):
        CalibrationSettings(seed=value)


def test_the_limit_itself_is_allowed():
    assert CalibrationSettings(budget=MIN_SIMULATIONS).budget == MIN_SIMULATIONS


def test_an_unknown_setting_is_refused():
    with pytest.raises(InputError, match="^budgett: "):
        CalibrationSettings(**{"budgett": 20})


def test_settings_are_plain_values():
    settings = CalibrationSettings(seed=4)
    assert asdict(settings)["seed"] == 4
    assert pickle.loads(pickle.dumps(settings)) == settings
    with pytest.raises(InputError, match="^seed: "):
        replace(settings, seed=-1)


def test_an_effect_that_is_named_twice_counts_once():
    settings = CriticismSettings(effects=("a", "b", "a"), accept=("b", "b"))
    assert (settings.effects, settings.accept) == (("a", "b"), ("b",))


@pytest.mark.parametrize("number", [0.1, np.float32(0.1), np.array(0.1), DataArray(0.1)])
def test_a_number_may_be_an_array_without_axes(number):
    assert number_of(number, "a") == check_effects({"adhesion": number}, "pour")["adhesion"]
    assert type(number_of(number, "a")) is float


@pytest.mark.parametrize("other", [True, "0.1", None, np.array([0.1]), np.array(True), np.nan])
def test_what_is_no_number_is_refused(other):
    with pytest.raises(InputError, match="^a: .*give one finite number"):
        number_of(other, "a")
    with pytest.raises(InputError, match="^--effect adhesion=.*give adhesion=NUMBER"):
        check_effects({"adhesion": other}, "pour")
