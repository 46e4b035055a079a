"""How well the pour of a posterior so far is known, against pours in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.inference.simulations import Compute
from scipy.special import ndtr

from bolfi_liquids import inference
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.known import regret_of
from bolfi_liquids.pouring.spillage import landing_sd

CUPS = bundled_cups()
POURS = 64
STREAM_SD = 0.008  # m, of the pours that are made up
TRUTH = {"viscosity": np.array([0.5]), "cohesion": np.array([0.4])}


def fitted():
    """A posterior of half a decade of viscosity."""

    def simulate(theta, seeds):
        return np.log10(theta["viscosity"])[:, None] + theta["cohesion"][:, None] * [0.0, 0.01]

    observed = simulate(TRUTH, None)[0]
    how = {"budget": 20, "confirm": 0, "warn": False, "progress": False}
    return inference.fit(simulate, default_prior(), observed, noise=0.5, **how)


def exact_regret(made_up, fit):
    """95 % quantile over the posterior of what its best pour spills too much, by the formula of
    the made-up pours over a grid of actions."""
    drawn = fit.sample("quadrature", chains=2, draws=200, seed=7, warn=False)["posterior"]
    viscosity, cohesion = (drawn[n].to_numpy().ravel()[:, None, None] for n in TRUTH)
    distance = np.linspace(*CUPS.distance_range, 71)
    rate = np.geomspace(*CUPS.angular_velocity_range, 31)[:, None]
    middle = made_up.middle(viscosity, cohesion, rate)
    sd, radius = np.hypot(STREAM_SD, landing_sd(CUPS)), CUPS.receiver.radius
    caught = ndtr((distance + radius - middle) / sd) - ndtr((distance - radius - middle) / sd)
    spilled = ((1.0 - made_up.film(viscosity)) * (1.0 - caught)).reshape(400, -1)
    return np.quantile(spilled[:, spilled.mean(axis=0).argmin()] - spilled.min(axis=1), 0.95)


def farther(_, viscosity, cohesion, rate, adhesion=0.0):
    """Of a stream [m] whose place depends on the viscosity more than that of other tests."""
    return 0.03 - 0.015 * np.log(viscosity / 0.5) + 0.01 * np.log(rate) - 0.005 * cohesion


@pytest.mark.slow
def test_the_error_is_the_regret_of_the_best_pour_and_nothing_is_poured_twice(made_up, monkeypatch):
    monkeypatch.setattr(type(made_up), "middle", farther)
    stirring = SimpleNamespace(recordings=[SimpleNamespace(number=lambda _: 1000.0)])
    with inference.SimulationBank(":memory:") as bank:
        given = CUPS, POURS, stirring, default_prior(), Compute(bank=bank), False
        error = regret_of(*given)
        regret_of(*given)
        assert sum(made_up.calls) == POURS == len(bank)
    fit = fitted()
    exact = exact_regret(made_up, fit)
    assert exact > 0.05  # or this shows nothing
    assert error(fit) == pytest.approx(exact, rel=0.25)
