"""Effects in the liquid: their hooks, what they do, and that they leave alone what they should."""

import numpy as np
import pytest
from bolfi_liquids.models.fluid import runtime
from bolfi_liquids.models.validation.analysis.profiles import binned_profile
from bolfi_liquids.models.validation.scenes.channel import Channel, Drive, channel_flow
from bolfi_liquids.models.validation.truths.generalised_flows import herschel_bulkley_channel

from bolfi_liquids import models


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
def test_a_rheology_from_outside_acts(register):
    """Twice half the viscosity is the same flow."""
    register(thicken())

    def flow(viscosity, factor):
        # one at a time, each in the same packing: between packings speeds differ by 5 %
        liquid = models.Liquid(viscosity, 0.0, 1000.0)
        drive = Drive(np.zeros(1), np.full(1, 0.5), np.zeros_like)
        effects = {"thicken": np.full(1, factor)}
        _, u = channel_flow(Channel(layers=6), liquid, drive, [0.75], effects=effects)
        return u.mean()

    base = flow(1.0, 1.0)
    assert flow(0.5, 2.0) == pytest.approx(base, rel=0.05)
    assert flow(1.0, 2.0) < 0.7 * base


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


FEW = 2600  # particles, in cells of 5 mm


def landed(cups, **liquid):
    effects = liquid.pop("effects", None)
    made = models.Liquid(**{"viscosity": 0.05, "cohesion": 0.6, "density": 1000.0, **liquid})
    return models.landings(made, 2.0, cups, [0], FEW, effects).position


@pytest.mark.slow
def test_adhesion_is_wetting_beyond_the_contact_angle(cups):
    """The cosines of 60 and 110 degrees differ by 0.842."""
    beyond = float(np.cos(np.radians(110.0)) - np.cos(np.radians(60.0)))
    source = cups.source.model_copy(update={"contact_angle_deg": 110.0})
    other = landed(cups.model_copy(update={"source": source}))
    plain = landed(cups)
    effect = landed(cups, effects={"adhesion": beyond})
    np.testing.assert_allclose(effect, other, atol=1e-3)  # the cosines differ in their last bit
    np.testing.assert_array_equal(landed(cups, adhesion=beyond), effect)
    np.testing.assert_array_equal(landed(cups, effects={"adhesion": 0.0}), plain)
    # the stream clings less to the rim, and lands farther out
    assert np.nanmean(other[..., 0]) > np.nanmean(plain[..., 0]) + 0.002


@pytest.mark.slow
def test_a_liquid_may_name_its_adhesion(cups):
    with pytest.raises(ValueError, match=r"adhesion is 0\.7, but effects say 0\.5; give one"):
        landed(cups, adhesion=0.7, effects={"adhesion": 0.5})
    with pytest.raises(ValueError, match="adhesion must be -2 to 2"):
        landed(cups, effects={"adhesion": -2.5})
