"""Effects in the liquid: their hooks, what they do, and that they leave alone what they should."""

import numpy as np
import pytest
from bolfi_liquids.models import pouring
from bolfi_liquids.models.fluid import runtime
from bolfi_liquids.models.validation.analysis.profiles import binned_profile
from bolfi_liquids.models.validation.scenes.channel import Channel, Drive, channel_flow
from bolfi_liquids.models.validation.truths.generalised_flows import herschel_bulkley_channel

from bolfi_liquids import models


def push():
    """An effect that drives the liquid along x by its coefficient [m/s²]."""

    def make():
        import taichi as ti

        @ti.func
        def along(scene: ti.template(), b, coefficient):
            for i in range(scene.alive[b]):
                scene.velocity[b, i] = scene.velocity[b, i] + ti.math.vec3(
                    scene.dt * coefficient, 0.0, 0.0
                )

        return along

    return _effect("push", make_force=make)


def thicken():
    """An effect that multiplies the viscosity."""

    def make():
        import taichi as ti

        @ti.func
        def times(viscosity, shear_rate, time, coefficient):
            return viscosity * coefficient

        return times

    return _effect("thicken", neutral=1.0, make_rheology=make)


def _effect(name, **changes):
    fields = {
        "unit": "1",
        "neutral": 0.0,
        "acts_in": "liquid",
        "text": "Brought along.",
        "source": "This test",
        "make_prior": lambda: None,
    }
    return models.Effect(name=name, **{**fields, **changes})


@pytest.mark.minutes
def test_hooks_from_outside_act(register):
    """A force equal to the scene's own, and a factor on the viscosity: the same flow."""
    for effect in (push(), thicken()):
        register(effect)

    def flow(viscosity, own, pushed, factor):
        # one at a time, each in the same packing: between packings speeds differ by 5 %
        liquid = models.Liquid(viscosity, 0.0, 1000.0)
        drive = Drive(np.zeros(1), np.full(1, own), np.zeros_like)
        effects = {"push": np.full(1, pushed), "thicken": np.full(1, factor)}
        _, u = channel_flow(Channel(layers=6), liquid, drive, [0.75], effects=effects)
        return u.mean()

    base = flow(1.0, 0.5, 0.0, 1.0)
    assert flow(1.0, 0.0, 0.5, 1.0) == pytest.approx(base, rel=0.05)
    assert flow(0.5, 0.0, 0.5, 2.0) == pytest.approx(base, rel=0.05)
    assert flow(1.0, 0.0, 0.5, 2.0) < 0.7 * base


@pytest.mark.minutes
def test_gels_flow_as_plugs():
    """A plug of a quarter of the gap, within a tenth of its speed (Herschel-Bulkley)."""
    channel, push, stress, still = Channel(layers=12), 1.0, 10.0, np.zeros(2)
    z, u = channel_flow(
        channel,
        models.Liquid(2.0, 0.0, 1000.0),
        Drive(still, still + push, np.zeros_like),
        [1.5, 2.0],
        effects={"yield_stress": still + stress},
    )
    profile = binned_profile(z, u, 0.0, channel.gap, channel.layers)
    expected = herschel_bulkley_channel(
        profile.at, gap=channel.gap, gradient=1000.0 * push, consistency=2.0, yield_stress=stress
    )
    inner = slice(1, -1)  # a bin at a wall cannot follow the slope there
    assert np.abs(profile.mean - expected)[inner].max() < 0.1 * expected.max()


def test_viscosity_by_formula():
    """What the hooks make of a viscosity, without a liquid."""
    runtime.start()
    import taichi as ti

    rate = np.array([0.0, 1e-5, 0.1, 1.0, 30.0], np.float32)
    out = ti.field(ti.f32, len(rate))

    def through(name, coefficient, time=0.0):
        hook = models.EFFECTS[name].make_rheology()

        @ti.kernel
        def fill(rates: ti.types.ndarray()):
            for k in out:
                out[k] = hook(2.0, rates[k], time, coefficient)

        fill(rate)
        return out.to_numpy()

    np.testing.assert_allclose(through("warming", 0.1, 3.0), 2.0 * np.exp(-0.3), rtol=1e-6)
    np.testing.assert_allclose(
        through("shear_thinning", 0.4), 2.0 * (1.0 + rate.astype(float) ** 2) ** -0.2, rtol=1e-5
    )
    m, r = 4.0, np.maximum(rate.astype(float), 1e-9)
    np.testing.assert_allclose(
        through("yield_stress", 10.0), 2.0 - 10.0 * np.expm1(-m * r) / r, rtol=1e-4
    )


def retained(cups, adhesion, viscosity, hold=0.9):
    plan = cups.pour.model_copy(update={"hold": hold})
    liquid = models.Liquid(viscosity, 0.0, 1000.0, adhesion=adhesion)
    action = models.PourAction(np.pi, 0.02)
    held = cups.model_copy(update={"pour": plan})
    return models.pour(liquid, action, held, np.zeros(len(viscosity), int)).retained


@pytest.mark.minutes
def test_a_film_sticks_and_drains(cups):
    viscosity = np.array([0.01, 0.1, 1.0])
    bare, sticky = retained(cups, 0.0, viscosity), retained(cups, 1.0, viscosity)
    assert (bare[:2] == 0.0).all()
    assert (sticky >= 0.1).all() and (np.diff(sticky) > 0.0).all()
    later = retained(cups, 1.0, viscosity, hold=2.9)
    assert (later < sticky).all() and (later > bare).all()


@pytest.mark.minutes
def test_adhesion_keeps_liquid_in_the_cup(cups):
    bare, sticky = (retained(cups, a, np.array([0.05]))[0] for a in (0.0, 1.0))
    assert bare == 0.0
    assert sticky > 0.1


@pytest.mark.minutes
def test_adhesion_does_not_heat(cups):
    """A liquid at rest stays so: below 1.3 cm/s, where it has 0.5 without adhesion."""
    from bolfi_liquids.models.fluid.packing import pack_cylinder

    adhesion = models.EFFECTS["adhesion"]
    particles, source = 664, cups.source
    scene = pouring._scene(cups, particles, (adhesion,))
    shift = np.array([source.radius, 0.0, source.height])
    scene.place_cups(np.ones(1))
    points = pack_cylinder(source.radius, scene.spacing, particles, 0) - shift
    (packing,) = scene.settled([points], 0.6)
    scene.place([packing.position], [packing.multiplier])
    scene.pour_in(models.Liquid(0.01, 0.0, 1000.0).batch(1), np.ones((1, 1)))
    scene.settle(1, int(3.0 * scene.rate), 1.0)
    speed = np.linalg.norm(scene.velocity.to_numpy()[0], axis=1)
    assert np.sqrt(np.mean(speed**2)) < 0.013


@pytest.mark.minutes
def test_a_liquid_may_name_its_adhesion(cups):
    action = models.PourAction(np.pi, 0.02)

    def pour(adhesion, effects=None):
        liquid = models.Liquid([0.05, 0.05], 0.0, 1000.0, adhesion=adhesion)
        return models.pour(liquid, action, cups, [0, 0], effects=effects).retained

    np.testing.assert_array_equal(pour([0.0, 0.7]), pour(0.0, {"adhesion": [0.0, 0.7]}))
    np.testing.assert_array_equal(pour(0.7), pour(0.7, {"adhesion": 0.7}))
    with pytest.raises(ValueError, match=r"adhesion is 0\.7, but effects say 0\.5; give one"):
        pour(0.7, {"adhesion": 0.5})
    with pytest.raises(ValueError, match="adhesion must be 0 to 4"):
        pour(0.0, {"adhesion": -0.5})
