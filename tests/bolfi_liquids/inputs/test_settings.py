"""Settings are checked when they are made, and a refusal names option and value."""

import pickle
from dataclasses import asdict, replace

import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.settings import (
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
        (CalibrationSettings, "--budget", "budget", MIN_SIMULATIONS - 1),
        (CalibrationSettings, "--seed", "seed", 1.5),
        (CalibrationSettings, "--seed", "seed", True),
        (CalibrationSettings, "--chains", "chains", 1),
        (CalibrationSettings, "--sampler", "sampler", "gibbs"),
        (PourSettings, "--risk", "risk", "worst"),
        (PourSettings, "--draws", "draws", "16"),
        (CriticismSettings, "--seed", "seed", -1),
        (SbcSettings, "--noise", "noise_deg", float("nan")),
        (OnlineSettings, "online setting target", "target", 1.0),
        (OnlineSettings, "online setting least_strokes", "least_strokes", 0),
    ],
)
def test_a_value_that_breaks_a_rule_is_named(kind, where, name, value):
    with pytest.raises(InputError) as refused:
        kind(**{name: value})
    assert (refused.value.where, refused.value.what) == (where, repr(value))
    assert refused.value.fix


def test_the_limit_itself_is_allowed():
    assert CalibrationSettings(budget=MIN_SIMULATIONS).budget == MIN_SIMULATIONS


def test_an_unknown_setting_is_refused():
    with pytest.raises(InputError, match="--budgett"):
        CalibrationSettings(**{"budgett": 20})


def test_settings_are_plain_values():
    settings = CalibrationSettings(seed=4)
    assert asdict(settings)["seed"] == 4
    assert pickle.loads(pickle.dumps(settings)) == settings
    with pytest.raises(InputError, match="--seed"):
        replace(settings, seed=-1)
