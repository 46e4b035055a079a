"""Which pours are asked for: all over the posterior, and few that another posterior has not."""

import numpy as np

from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.pours import (
    RATE,
    box_around,
    joint_prior,
    whole,
)


def posterior(median, sd=0.15, **more):
    rng = np.random.default_rng(3)
    viscosity = median * np.exp(sd * rng.standard_normal(2000))
    return {"viscosity": viscosity, "cohesion": rng.uniform(0.3, 0.9, 2000), **more}


def box_of(draws, effects=()):
    best = {name: float(np.median(values)) for name, values in draws.items()}
    return box_around(joint_prior(default_prior(), effects, bundled_cups()), draws, best)


def named(box, count):
    return {(tuple(sorted(job.theta.items())), job.seed) for job in box.jobs(count)}


def test_pours_cover_the_posterior_and_every_angular_velocity():
    draws = posterior(0.4)
    jobs = box_of(draws).jobs(64)
    assert len(jobs) == 64
    low, high = bundled_cups().angular_velocity_range
    rates = np.array([job.theta[RATE] for job in jobs])
    assert rates.min() > 0.99 * low and rates.max() < 1.01 * high
    assert np.histogram(np.log(rates), 4, np.log([low, high]))[0].min() >= 10
    viscosity = np.array([job.theta["viscosity"] for job in jobs])
    assert viscosity.min() < np.quantile(draws["viscosity"], 0.02)
    assert viscosity.max() > np.quantile(draws["viscosity"], 0.98)
    assert np.log(viscosity.max() / viscosity.min()) < np.log(5.0)  # and not much more


def test_a_posterior_that_hardly_moved_asks_for_nothing_new():
    box, moved = box_of(posterior(0.4)), box_of(posterior(0.4, sd=0.152))
    assert np.array_equal(box.low, moved.low) and np.array_equal(box.high, moved.high)
    assert named(box, 40) < named(box, 64) == named(moved, 64)


def test_a_posterior_beside_the_first_asks_for_what_that_lacks():
    first, second = box_of(posterior(0.4)), box_of(posterior(0.65))
    shared = first.holds(first.prior.to_unit(theta_of(second.jobs(64)))).mean()
    new = len(named(second, 64) - named(first, 64))
    assert 0.3 < shared < 1.0 and 0 < new < 64


def theta_of(jobs):
    return {name: np.array([job.theta[name] for job in jobs]) for name in jobs[0].theta}


def test_the_best_liquid_lies_inside_with_and_without_an_effect():
    draws = posterior(0.4, adhesion=np.linspace(0.5, 0.7, 2000))
    prior = joint_prior(default_prior(), ["adhesion"], bundled_cups())
    best = {"viscosity": 2.0, "cohesion": 0.05, "adhesion": 0.9}
    box = box_around(prior, draws, best)
    assert box.effects == ("adhesion",)
    for liquid in (best, {**best, "adhesion": 0.0}):
        assert box.holds(prior.to_unit({**liquid, RATE: 1.0})[None]).all()


def test_a_posterior_as_narrow_as_can_be_has_a_box_with_pours_in_it():
    exact = {name: np.full(9, value) for name, value in (("viscosity", 0.4), ("cohesion", 0.5))}
    exact["adhesion"] = np.full(9, 0.3)
    exact["yield_stress"] = np.full(9, 0.0)
    assert len(box_of(exact, ("adhesion", "yield_stress")).jobs(100)) == 100


def test_only_effects_of_pours_are_inputs():
    names = ["camera_tilt", "yield_stress", "adhesion", "gripper_scale", "viscosity"]
    prior = joint_prior(default_prior(), names, bundled_cups())
    assert prior.names == ("viscosity", "cohesion", "adhesion", "yield_stress", RATE)


def test_pours_of_like_viscosity_and_duration_come_together():
    box = whole(joint_prior(default_prior(), (), bundled_cups()))
    jobs = theta_of(box.jobs(128))
    batches = np.log(jobs["viscosity"]).reshape(16, 8)
    assert np.ptp(batches, axis=1).mean() < 0.2 * np.ptp(batches)
    turning = np.log(jobs[RATE]).reshape(16, 8)
    assert np.median(np.ptp(turning, axis=1)) < 0.8 * np.ptp(turning)
