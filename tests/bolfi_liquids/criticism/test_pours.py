"""Pours as a simulator that can be criticised: outcomes, noise, and the prior of stirs."""

import numpy as np
import pytest
from bolfi_liquids.inference.surrogates.measurement_noise import Layout

from bolfi_liquids import models
from bolfi_liquids.criticism.pours import (
    REPEATABILITY_SD,
    SIMULATOR_ERROR_SD,
    Fractions,
    PourNoise,
    as_prior,
    pour_proposals,
)
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.seeds import Phase, simulation_seeds
from bolfi_liquids.simulators import PourSimulator

RATE = np.radians([160.0, 120.0, 160.0, 180.0, 120.0])  # neither sorted nor once each
DISTANCE = np.array([0.01, 0.03, 0.04, 0.02, -0.01])
DENSITY = 1000.0


@pytest.mark.slow
def test_each_pour_spills_what_it_spills_alone():
    cups, seeds = bundled_cups(), np.array([3, 5])
    theta = {"viscosity": np.array([0.01, 1.0]), "cohesion": np.array([0.2, 0.7])}
    pours = PourSimulator(cups, DENSITY, Fractions(RATE, DISTANCE))
    signals = pours.simulate(theta, seeds)
    rates = np.unique(RATE)
    for run, seed in enumerate(seeds):
        one = {name: values[run] for name, values in theta.items()}
        drawn = simulation_seeds(int(seed), Phase.RUNS_OF_POURS, len(rates))
        own = np.array(drawn)[np.searchsorted(rates, RATE)]
        alone = models.pour(
            models.Liquid(**one, density=DENSITY), models.PourAction(RATE, DISTANCE), cups, own
        )
        np.testing.assert_array_equal(signals[run], [alone.spilled, alone.retained])


def test_pours_of_like_actions_are_wrong_together_and_outcomes_apart():
    noise = PourNoise(np.radians([45.0, 46.0, 170.0]), np.array([0.02, 0.021, 0.06]))
    at = Layout(np.tile([0, 1, 2], 2), np.repeat([0, 1], 3))  # pours, outcomes
    covariance = noise.covariance(at)
    sd = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(sd, np.hypot(REPEATABILITY_SD, np.repeat(SIMULATOR_ERROR_SD, 3)))
    correlation = covariance / np.outer(sd, sd)
    assert correlation[0, 1] > 0.9 > 0.2 > correlation[0, 2] >= 0.0
    assert (correlation[:3, 3:] == 0.0).all()
    drawn = noise.draw(np.random.default_rng(0), at, 20_000)
    np.testing.assert_allclose(np.cov(drawn.T), covariance, atol=6.0 * 0.01 * sd.max() ** 2)


def test_proposed_pours_are_within_what_the_cups_allow():
    cups = bundled_cups()
    made = pour_proposals(cups, DENSITY)
    assert len({one.label for one in made}) == len({one.identity for one in made}) == len(made) == 2
    for one in made:
        noise = one.noise
        assert one.shape == (2, len(noise.distance))
        for values, limits in (
            (noise.angular_velocity, cups.angular_velocity_range),
            (noise.distance, cups.distance_range),
        ):
            assert limits[0] <= values.min() <= values.max() < limits[1]


@pytest.mark.slow
def test_what_stirs_taught_becomes_a_prior_of_the_same_mean_and_spread():
    rng = np.random.default_rng(1)
    theta = {
        "viscosity": np.exp(rng.normal(-2.0, 0.4, 4000)),
        "cohesion": rng.uniform(0.0, 1.0, 4000),
    }
    learned = as_prior(theta, np.full(4000, 1 / 4000), default_prior())
    median = learned.from_unit(np.full((1, 2), 0.5))
    assert abs(np.log(median["viscosity"][0]) + 2.0) < 0.05
    upper = learned.from_unit(np.full((1, 2), 0.841))
    assert abs(np.log(upper["viscosity"][0]) + 1.6) < 0.05
    ends = learned.from_unit(np.array([[0.0, 0.0], [1.0, 1.0]]))["cohesion"]
    np.testing.assert_allclose(ends, [0.0, 1.0], atol=1e-6)
