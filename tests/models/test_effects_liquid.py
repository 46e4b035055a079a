"""Effects in the liquid: their hooks, what they do, and that they leave alone what they should."""

from types import SimpleNamespace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.models import runtime

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
        "make_prior": lambda: dist.HalfNormal(3.0),
    }
    return models.Effect(name=name, **{**fields, **changes})


def start_of(path, seconds):
    early = path.time < seconds
    return SimpleNamespace(time=path.time[early], position=path.position[early])


@pytest.mark.slow
def test_a_rheology_from_outside_acts(register, glycerin):
    """Twice half the viscosity is the same stir, but for rounding."""
    register(thicken())
    setup = models.StirSetup.from_recording(glycerin)
    path = start_of(glycerin.gripper, 1.5)
    plain = models.stir(models.Liquid([1.0, 2.0], 0.2, 1260.0), path, setup, [0, 0])
    liquid = models.Liquid([0.5, 1.0], 0.2, 1260.0)
    thickened = models.stir(liquid, path, setup, [0, 0], {"thicken": 2.0})
    np.testing.assert_allclose(thickened, plain, atol=1e-3 * np.ptp(plain))


@pytest.mark.slow
def test_a_viscosity_may_vary_by_thousands_within_the_cup(glycerin):
    """A gel of 0.03 Pa s that yields at 30 Pa: at rest 4000 times as thick as where it flows."""
    setup = models.StirSetup.from_recording(glycerin)
    liquid = models.Liquid(0.03, 0.2, 1000.0)
    path = start_of(glycerin.gripper, 2.5)
    gel, again = models.stir(liquid, path, setup, [0, 1], {"yield_stress": 30.0})
    assert np.isfinite(gel).all()
    thin, held = models.stir(models.Liquid([0.03, 120.0], 0.2, 1000.0), path, setup, [0, 0])

    def apart(one, other):
        return np.sqrt(np.mean((one - other) ** 2))

    # where the stick does not make it yield, it carries the stick along like what hardly flows
    assert max(apart(gel, again), apart(gel, held)) < 0.1 * apart(gel, thin)


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
