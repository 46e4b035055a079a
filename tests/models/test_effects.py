"""The registry, and what holds for every effect in it."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.models import effects as registry
from bolfi_liquids.models.effect_coefficients import acting_in, changed_signal
from jax import random

from bolfi_liquids import models

LIQUID = models.Liquid(viscosity=0.1, cohesion=0.2, density=1000.0)
SEEDS = np.array([3, 1, 2])


def outside(name="wind", **changes):
    fields = {
        "name": name,
        "unit": "1",
        "neutral": 0.0,
        "acts_in": "sensor",
        "text": "An effect that a user brings along.",
        "source": "This test",
        "make_prior": lambda: dist.Normal(0.0, 1.0),
        "signal": lambda time, angles, coefficient: angles + coefficient[:, None, None],
    }
    return models.Effect(**{**fields, **changes})


def coefficient(name, key=0):
    """A value that is surely not neutral."""
    effect = models.EFFECTS[name]
    value = float(effect.prior.sample(random.key(key)))
    assert value != effect.neutral
    return value


@pytest.fixture
def stir(glycerin):
    gripper = glycerin.gripper
    setup = models.StirSetup.from_recording(glycerin, particles=150)
    moving = (gripper.time > 0.5) & (gripper.time < 0.8)
    short = SimpleNamespace(time=gripper.time[moving], position=gripper.position[moving])

    def run(effects=None, part=slice(None), liquid=LIQUID):
        return models.stir(liquid, short, setup, SEEDS[part], effects)

    return run


@pytest.fixture
def pour(cups):
    def run(effects=None):
        action = models.PourAction(angular_velocity=6.0, distance=[0.01, 0.03, 0.05])
        result = models.pour(LIQUID, action, cups, SEEDS, particles=150, effects=effects)
        return np.stack([result.spilled, result.received, result.retained])

    return run


@pytest.mark.minutes
def test_all_effects_together_stay_neutral_where_they_are(stir):
    neutral = {name: effect.neutral for name, effect in models.EFFECTS.items()}
    base = stir()
    np.testing.assert_array_equal(stir(neutral), base)
    mixed = stir({name: [coefficient(name), neutral[name], neutral[name]] for name in neutral})
    np.testing.assert_array_equal(mixed[1:], base[1:])


@pytest.mark.minutes
def test_effects_compose_whatever_the_order_they_are_given_in(stir):
    every = {name: coefficient(name) for name in models.EFFECTS}
    together = stir(every)
    np.testing.assert_array_equal(stir(dict(reversed(every.items()))), together)
    # each set of effects in the liquid compiles a scene; what one alone does is tested above
    for name in [name for name in every if models.EFFECTS[name].acts_in != "liquid"]:
        fewer = {other: value for other, value in every.items() if other != name}
        assert np.abs(stir(fewer) - together).max() > 1e-6, name


def test_sensors_act_after_the_rig_in_the_order_of_their_names(stir):
    sensors = [name for name, effect in models.EFFECTS.items() if effect.acts_in == "sensor"]
    values = {name: coefficient(name) for name in sensors}
    time = np.linspace(0.0, 1.0, 31)
    angles = 0.1 * np.random.default_rng(0).standard_normal((1, 31, 2))
    expected = angles
    for name in sorted(sensors):
        expected = models.EFFECTS[name].signal(time, expected, np.array([values[name]]))
    seen = changed_signal(time, angles, acting_in("stir", values, 1))
    np.testing.assert_array_equal(seen, expected)


@pytest.mark.minutes
def test_a_pour_keeps_every_bit_where_coefficients_are_neutral(pour):
    neutral = {name: effect.neutral for name, effect in models.EFFECTS.items()}
    mixed = pour({name: [neutral[name], coefficient(name), neutral[name]] for name in neutral})
    base = pour()
    np.testing.assert_array_equal(mixed[:, [0, 2]], base[:, [0, 2]])
    assert (mixed[:, 1] != base[:, 1]).any()


@pytest.mark.slow
def test_a_pour_takes_what_a_stir_taught(pour):
    """Effects that do not act in a pour are accepted there, and change nothing."""
    elsewhere = [name for name, effect in models.EFFECTS.items() if "pour" not in effect.scenes]
    assert {"fill_level", "stick_mass", "camera_delay"} <= set(elsewhere)
    neutral = {name: effect.neutral for name, effect in models.EFFECTS.items()}
    base = pour()
    np.testing.assert_array_equal(pour({name: coefficient(name) for name in elsewhere}), base)
    np.testing.assert_array_equal(pour(neutral), base)
    with pytest.raises(ValueError, match="unknown effects: wind"):
        pour({"wind": 1.0})


@pytest.mark.slow
def test_an_effect_from_outside_acts_like_a_built_in_one(stir, register):
    """One in the rig (the gripper is raised at the end) and one in the sensor (a gain)."""

    def lift(rig, coefficient):
        rise = np.linspace(0.0, 1.0, rig.path.shape[1])
        height = rig.path[..., 2] + coefficient[:, None] * rise
        return rig._replace(path=np.concatenate([rig.path[..., :2], height[..., None]], axis=-1))

    def amplify(time, angles, coefficient):
        return angles * coefficient[:, None, None]

    register(outside("lift", acts_in="rig", unit="m", signal=None, rig=lift))
    register(outside("gain", neutral=1.0, signal=amplify))
    base = stir()
    np.testing.assert_array_equal(stir({"lift": 0.0, "gain": 1.0}), base)
    np.testing.assert_array_equal(stir({"gain": [1.0, 2.0, 0.5]}), base * [[[1]], [[2]], [[0.5]]])
    lifted = stir({"lift": [0.0, 0.03, 0.0]})
    np.testing.assert_array_equal(lifted[[0, 2]], base[[0, 2]])
    assert np.abs(lifted[1] - base[1]).max() > 1e-4
    np.testing.assert_array_equal(stir({"gain": 2.0, "lift": [0.0, 0.03, 0.0]}), 2.0 * lifted)


@pytest.mark.slow
def test_a_stir_that_diverged_stays_nan_behind_every_sensor(stir):
    liquid = models.Liquid([0.1, 3e38, 0.1], 0.0, 1000.0)
    sensors = {n: coefficient(n) for n, e in models.EFFECTS.items() if e.acts_in == "sensor"}
    with pytest.warns(models.FailedSimulation, match="too large"):
        signal = stir(sensors, liquid=liquid)
    assert np.isnan(signal[1, 1:]).all()
    assert np.isfinite(signal[[0, 2]]).all()


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"wind": 1.0}, "unknown effects: wind; there are .*camera_delay"),
        ({"fill_level": [0.0, 0.0]}, r"fill_level has shape \(2,\).*3 simulations"),
        ({"fill_level": np.zeros((3, 1))}, r"fill_level has shape \(3, 1\)"),
        ({"camera_delay": np.nan}, "camera_delay must be finite"),
        ({"camera_delay": [0.0, np.inf, 0.0]}, "camera_delay must be finite"),
        ({"camera_delay": "late"}, "camera_delay must be a number or an array, got 'late'"),
        ({"camera_delay": None}, "camera_delay must be finite, got None"),
        (["fill_level"], "must map names to coefficients"),
        ({"pivot_friction": -1e-4}, "pivot_friction must be 0 to inf, got -0.0001"),
        ({"stick_mass": [1.0, -1.0, 1.0]}, "stick_mass must be 0.01 to inf"),
        ({"gripper_scale": 1e9}, "path must be finite and within 10 m"),
        ({"gripper_scale": -1.0}, "gripper_scale must be 0 to inf"),
        ({"fill_level": 1.0}, r"fill must be 0 to 0\.075 m, got 1\.05.*effects fill_level"),
    ],
)
def test_bad_coefficients_are_named(stir, effects, message):
    with pytest.raises(ValueError, match=message):
        stir(effects)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "side wind"}, "'side wind': name must be an identifier"),
        ({"name": "cohesion"}, "taken by a liquid's cohesion"),
        ({"unit": ""}, "unit must say something"),
        ({"text": " "}, "text must say something"),
        ({"source": None}, "source must say something"),
        ({"neutral": np.nan}, "neutral must be finite"),
        ({"neutral": "0"}, "neutral must be a number"),
        ({"acts_in": "robot"}, "acts_in must be one of liquid, rig, sensor"),
        ({"acts_in": "rig"}, "needs the hook rig"),
        ({"signal": None}, "needs the hook signal"),
        ({"acts_in": "liquid"}, "needs the hook make_rheology or wetting"),
        ({"lowest": 1.0}, "neutral must be finite and lie between 1.0 and inf"),
        ({"signal": 1.0}, "hook signal must be a function"),
        ({"make_prior": 1.0}, "make_prior must return"),
    ],
)
def test_nonsense_is_no_effect(changes, message):
    with pytest.raises(ValueError, match=message):
        outside(**changes)


@pytest.mark.parametrize("name", models.EFFECTS)
def test_limits_hold_the_prior(name):
    effect = models.EFFECTS[name]
    drawn = np.asarray(effect.prior.sample(random.key(0), (2000,)))
    assert effect.lowest <= drawn.min() and drawn.max() <= effect.highest


def test_the_registry_takes_only_new_effects(register):
    with pytest.raises(ValueError, match="already an effect 'camera_delay'.*another name"):
        models.register(outside("camera_delay"))
    with pytest.raises(ValueError, match=r"models\.Effect, got 'wind'"):
        models.register("wind")
    with pytest.raises(TypeError):
        models.EFFECTS["wind"] = outside()
    wind = register(outside())
    assert models.EFFECTS["wind"] is wind
    with pytest.raises(dataclasses.FrozenInstanceError):
        wind.neutral = 1.0


def doubled_in_place(time, angles, coefficient):
    angles *= 2.0
    return angles


def late_time(time, angles, coefficient):
    time += 1.0
    return angles


def rolled(time, angles, c):
    """Random, and nothing at the neutral coefficient."""
    return angles + c[:, None, None] * np.random.default_rng().normal()


def rig_of(change):
    return {"acts_in": "rig", "rig": change, "signal": None}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"signal": lambda time, angles, c: angles[..., 0]}, r"signal returned shape \(4, 61\)"),
        ({"signal": lambda time, angles, c: angles + np.nan}, "signal returned .*not finite"),
        ({"signal": lambda time, angles, c: angles + c}, "hook signal fails.*ValueError"),
        ({"signal": lambda time, angles, c: 2.0 * angles}, "at the neutral coefficient 0"),
        ({"signal": doubled_in_place}, "signal writes into its arguments"),
        ({"signal": late_time}, "signal writes into its arguments"),
        ({"signal": lambda angles: angles}, "hook signal fails.*TypeError"),
        ({"signal": lambda time, angles, c: angles + c.mean()}, "depend on other simulations"),
        ({"signal": lambda time, angles, c: angles + c[0]}, "depend on other simulations"),
        ({"signal": rolled}, "signal returns values that differ from call to call"),
        ({"signal": lambda time, angles, c: angles + 0j}, "complex128 values"),
        ({"signal": lambda time, angles, c: angles.astype(object)}, "object values"),
        (rig_of(lambda rig, c: c), "must return a Rig, got ndarray"),
        (rig_of(lambda rig, c: rig._replace(fill=0.05)), r"rig returned shape \(\)"),
        (rig_of(lambda rig, c: rig._replace(path=rig.path * np.nan)), "not finite"),
        (rig_of(lambda rig, c: rig._replace(fill=rig.fill * c)), "changes a value by 0.05"),
        ({"acts_in": "liquid", "wetting": lambda cosine, c: cosine[:1] + c[:1]}, "wetting"),
        ({"acts_in": "liquid", "make_rheology": lambda: 1 / 0}, "make_rheology fails: ZeroDiv"),
        ({"acts_in": "liquid", "make_rheology": lambda: None}, "must return a ti.func"),
        ({"make_prior": lambda: 3.0}, "must return a numpyro distribution, got 3.0"),
        ({"make_prior": lambda: 1 / 0}, "make_prior fails: ZeroDiv"),
        ({"make_prior": lambda: dist.Poisson(3.0)}, "one continuous number"),
        ({"make_prior": lambda: dist.Normal(np.zeros(2), 1.0)}, "one continuous number"),
        ({"make_prior": lambda: dist.Uniform(0.1, 1.0)}, "neutral coefficient 0.0 no density"),
        ({"make_prior": lambda: dist.LogNormal(0.0, 0.1)}, "neutral coefficient 0.0 no density"),
        ({"make_prior": lambda: dist.LogNormal(0.0, 1e4), "neutral": 1.0}, "draws must be finite"),
        ({"make_prior": lambda: dist.ImproperUniform(dist.constraints.real, (), ())}, "sampled"),
        ({"lowest": 0.0}, "% of the prior lies outside of lowest=0"),
        ({"lowest": -0.1, "highest": 0.1}, "% of the prior lies outside"),
    ],
)
def test_register_tries_prior_hooks_and_neutral_value(register, changes, message):
    with pytest.raises(ValueError, match=f"effect 'wind': .*{message}"):
        register(outside(**changes))
    assert "wind" not in models.EFFECTS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("base", "slope", "message"), [(1.0, -1e6, "not negative"), (2.0, 0.1, "makes .*neutral")]
)
def test_a_rheology_is_tried_before_a_scene_is_compiled(stir, register, base, slope, message):
    def make():
        import taichi as ti

        @ti.func
        def changed(viscosity, shear_rate, time, coefficient):
            return viscosity * (base + slope * coefficient * shear_rate)

        return changed

    register(outside(acts_in="liquid", signal=None, make_rheology=make))
    with pytest.raises(ValueError, match=f"effect 'wind': .*{message}"):
        stir({"wind": 1.0})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("late", "message"),
    [
        ({"signal": lambda time, angles, c: angles[..., :1]}, "signal of shape"),
        (rig_of(lambda rig, c: rig._replace(fill=rig.fill[:1])), "fill of shape"),
        (rig_of(lambda rig, c: rig._replace(path=rig.path * np.nan)), "path must be finite.*wind"),
    ],
)
def test_a_hook_that_returns_nonsense_later_is_named(stir, register, monkeypatch, late, message):
    monkeypatch.setattr(registry, "check_effect", lambda effect: None)
    register(outside(**late))
    with pytest.raises(ValueError, match=message):
        stir({"wind": 1.0})
