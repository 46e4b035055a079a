"""What every effect must do, of the model's, the example's, and one of your own.

`pytest tests/extensions --effect your_module:EFFECT` adds the last to each test.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.models import effects as registry
from bolfi_liquids.models import runtime
from bolfi_liquids.models.effect_check import check_effect, check_rheology
from jax import random

from bolfi_liquids import models
from bolfi_liquids.inputs.bundled import bundled_recording

from .clock_drift import EFFECT as CLOCK_DRIFT
from .named import named

LIQUID = models.Liquid(viscosity=0.1, cohesion=0.2, density=1000.0)
SEEDS = np.array([3, 1, 2])
SIMULATED_IN_CI = ("shear_thinning",)  # each effect in the liquid compiles a scene


def marks(name):
    if name in models.EFFECTS and models.EFFECTS[name].acts_in == "liquid":
        return pytest.mark.slow if name in SIMULATED_IN_CI else pytest.mark.minutes
    return pytest.mark.slow


def pytest_generate_tests(metafunc):
    own = metafunc.config.getoption("effect", default="")
    names = [*models.EFFECTS, "example", *([own] if own else [])]
    if "stir" in metafunc.fixturenames:
        names = [pytest.param(name, marks=marks(name)) for name in names]
    metafunc.parametrize("effect", names, indirect=True)


@pytest.fixture
def effect(request):
    """A registered effect, for one test."""
    if request.param in models.EFFECTS:
        yield models.EFFECTS[request.param]
        return
    own = CLOCK_DRIFT if request.param == "example" else named(request.param)
    models.register(own)
    yield own
    del registry._registered[own.name]


@pytest.fixture
def stir():
    """Stirs glycerin with a few particles for a third of a second."""
    recording = bundled_recording("glycerin")
    gripper = recording.gripper
    setup = models.StirSetup.from_recording(recording, particles=150)
    moving = (gripper.time > 0.5) & (gripper.time < 0.8)
    short = SimpleNamespace(time=gripper.time[moving], position=gripper.position[moving])

    def run(effects=None, part=slice(None)):
        return models.stir(LIQUID, short, setup, SEEDS[part], effects)

    return run


def test_it_explains_itself(effect):
    assert models.EFFECTS[effect.name] is effect
    assert effect.text.endswith(".") and len(effect.source) > 20
    assert effect.prior is effect.prior


def test_prior_and_hooks_are_as_register_wants_them(effect):
    """Which tries those that are not built in; a rheology is tried once Taichi runs."""
    check_effect(effect)
    if effect.make_rheology is not None:
        runtime.start()
        check_rheology(effect)


def test_a_neutral_coefficient_leaves_every_bit_of_a_stir(effect, stir):
    """And the company of a simulation changes none."""
    if "stir" not in effect.scenes:
        return
    base, neutral = stir(), effect.neutral
    assert np.isfinite(base).all() and np.ptp(base[:, -1], axis=0).min() > 0
    np.testing.assert_array_equal(stir({effect.name: neutral}), base)
    changed = float(effect.prior.sample(random.key(0)))
    mixed = stir({effect.name: [neutral, changed, neutral]})
    np.testing.assert_array_equal(mixed[[0, 2]], base[[0, 2]])
    assert np.abs(mixed[1] - base[1]).max() > 1e-5
    np.testing.assert_array_equal(stir({effect.name: changed}, slice(1, 2))[0], mixed[1])
