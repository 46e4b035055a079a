import numpy as np
import pytest
from bolfi_liquids.models.validation.truths import generalised_flows as flows
from bolfi_liquids.models.validation.truths import shear_flows

GAP, GRADIENT = 0.02, 800.0
Z = np.linspace(0.0, GAP, 4001)
LIQUIDS = [
    {"consistency": 0.5},
    {"consistency": 2.0, "index": 0.5},
    {"consistency": 1.0, "index": 1.4},
    {"consistency": 1.0, "yield_stress": 3.0},
    {"consistency": 4.0, "index": 0.4, "yield_stress": 2.0},
]


def profile(**liquid):
    return flows.herschel_bulkley_channel(Z, gap=GAP, gradient=GRADIENT, **liquid)


def test_without_yield_stress_and_thinning_it_is_the_parabola():
    expected = shear_flows.poiseuille_steady(Z, gap=GAP, gradient=GRADIENT, viscosity=0.5)
    np.testing.assert_allclose(profile(consistency=0.5), expected, atol=1e-12)


@pytest.mark.parametrize("liquid", LIQUIDS)
def test_the_profile_carries_the_stress_of_the_channel(liquid):
    """Numerical slope into the constitutive law; walls at rest; symmetric."""
    u = profile(**liquid)
    assert u[[0, -1]] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(u, u[::-1], atol=1e-12)
    rate = np.abs(np.gradient(u, Z))
    stress = GRADIENT * np.abs(Z - GAP / 2)
    yielding = liquid.get("yield_stress", 0.0)
    flowing = stress > yielding + 0.5
    flowing[[0, -1]] = False
    carried = yielding + liquid["consistency"] * rate ** liquid.get("index", 1.0)
    np.testing.assert_allclose(carried[flowing], stress[flowing], rtol=2e-3)
    np.testing.assert_allclose(rate[stress < yielding - 0.5], 0.0, atol=1e-12)


@pytest.mark.parametrize("liquid", LIQUIDS)
def test_flow_rate_is_the_profiles_integral(liquid):
    rate = flows.herschel_bulkley_flow_rate(gap=GAP, gradient=GRADIENT, **liquid)
    assert rate == pytest.approx(np.trapezoid(profile(**liquid), Z), rel=1e-5)


def test_below_the_yield_stress_nothing_flows():
    liquid = {"consistency": 1.0, "index": 0.5, "yield_stress": GRADIENT * GAP / 2}
    assert (profile(**liquid) == 0.0).all()
    assert flows.herschel_bulkley_flow_rate(gap=GAP, gradient=GRADIENT, **liquid) == 0.0


def test_integration_agrees_with_the_power_laws_closed_form():
    law = {"consistency": 2.0, "index": 0.5}
    ours = flows.generalised_channel(
        Z,
        gap=GAP,
        gradient=GRADIENT,
        viscosity=lambda rate: flows.power_law_viscosity(rate, **law),
    )
    np.testing.assert_allclose(ours, profile(**law), atol=1e-6 * ours.max())


def test_carreau_lies_between_its_limits():
    """Slow flow is Newtonian at rest's viscosity; fast flow is the power law."""
    law = {"zero": 5.0, "infinite": 0.0, "time": 0.5, "index": 0.4}

    def channel(gradient):
        return flows.generalised_channel(
            Z,
            gap=GAP,
            gradient=gradient,
            viscosity=lambda rate: flows.carreau_viscosity(rate, **law),
        )

    slow = shear_flows.poiseuille_steady(Z, gap=GAP, gradient=1.0, viscosity=5.0)
    np.testing.assert_allclose(channel(1.0), slow, atol=1e-4 * slow.max())
    consistency = 5.0 * 0.5 ** (0.4 - 1.0)
    fast = flows.herschel_bulkley_channel(
        Z, gap=GAP, gradient=1e5, consistency=consistency, index=0.4
    )
    np.testing.assert_allclose(channel(1e5), fast, rtol=1e-3, atol=1e-3 * fast.max())
    assert flows.carreau_viscosity(0.0, **law) == 5.0


def test_a_stress_that_cannot_be_carried_is_named():
    def saturating(rate):
        return 1.0 / (1.0 + rate)

    with pytest.raises(ValueError, match="no shear rate"):
        flows.generalised_channel(Z, gap=GAP, gradient=GRADIENT, viscosity=saturating)
