"""The search keeps to where it simulated, and goes on where the best fit lies at an end."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.hypothesis import weighted_posterior
from bolfi_liquids.inference.criticism.runs import PriorBox, sides
from bolfi_liquids.inference.criticism.search import examine, explain
from bolfi_liquids.inference.criticism.study import Study
from bolfi_liquids.inference.simulations import Compute

from bolfi_liquids import inference

TIME = np.linspace(0.0, 1.0, 40)
PRIOR = inference.Prior({"level": dist.Uniform(-2.0, 2.0)})
EXTENSIONS = {"ramp": criticism.Extension(dist.Uniform(-2.0, 2.0))}
NOISE = criticism.KnownNoise(0.02)


def ramp(theta, seeds):
    """An effect that a model without it takes for another level."""
    size = theta.get("ramp", np.zeros(len(seeds)))
    return theta["level"][:, None] + size[:, None] * (1.0 + 0.5 * TIME**2)


def study_of(data):
    experiment = criticism.Experiment(ramp, data, NOISE)
    return Study(experiment, PRIOR, EXTENSIONS, Compute(batch=64))


def observed(level, size=0.0):
    theta = {"level": np.array([level]), "ramp": np.array([size])}
    return ramp(theta, [0])[0] + 0.02 * np.random.default_rng(0).normal(size=len(TIME))


def test_a_point_at_a_wall_is_not_enclosed_unless_the_prior_ends_there():
    box = PriorBox(np.array([0.0, 0.2]), np.array([0.5, 1.0]))
    inside = [0.0, 0.6], [0.25, 1.0], [0.4, 0.9]
    outside = [0.499, 0.6], [0.25, 0.201], [0.6, 0.6], [0.25, 0.1]
    assert all(box.encloses(np.array(u)) for u in inside)
    assert not any(box.encloses(np.array(u)) for u in outside)


def test_a_hull_holds_both_boxes_and_an_intersection_is_in_both():
    one, other = PriorBox(np.zeros(2), np.full(2, 0.5)), PriorBox(np.array([0.2, 0.4]), np.ones(2))
    np.testing.assert_array_equal(one.hull(other), [[0.0, 0.0], [1.0, 1.0]])
    np.testing.assert_array_equal(one.intersection(other), [[0.2, 0.4], [0.5, 0.5]])


@pytest.mark.parametrize(
    ("prior", "neutral", "expected"),
    [
        (dist.Uniform(-1.0, 1.0), 0.0, [-0.6, 0.6, -0.3, 0.3]),
        (dist.Uniform(0.0, 1.0), 0.0, [0.6, 0.3, 0.2, 0.15]),
        (dist.Uniform(-1.0, 0.0), 0.0, [-0.6, -0.3, -0.2, -0.15]),
        (dist.Uniform(-1.0, 3.0), 0.0, [-0.6, 1.8, -0.3, 0.9]),
    ],
)
def test_effects_are_tried_on_both_sides_of_neutral_or_on_the_only_one(prior, neutral, expected):
    found = sides(criticism.Extension(prior, neutral), 4, 0.6)
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.slow
def test_best_fit_and_posterior_stay_where_the_model_was_simulated():
    """Data that lie beyond draw both to the end and no further."""
    within = PriorBox(np.array([0.2]), np.array([0.5]))
    study = study_of(observed(1.5))
    runs = study.run("start", within.fill(PRIOR, 0, 12))
    found = study.hypothesis((), runs, within)
    assert found.u[0] == pytest.approx(0.5, abs=0.01)
    level = weighted_posterior(found).draw(0, 200)["level"]
    assert level.max() < 4.0 * 0.55 - 2.0


@pytest.mark.slow
def test_a_truth_outside_of_the_box_of_the_model_without_the_effect_is_reached():
    """The base model fits best at 1.6, half of the prior's range away."""
    study = study_of(observed(0.0, 1.4))
    base = examine(study, None)
    assert not base.box.encloses(np.array([0.5]))
    _, accepted = explain(study, base)
    (one,) = accepted
    assert one.hypothesis.best == pytest.approx({"level": 0.0, "ramp": 1.4}, abs=0.1)
    assert one.hypothesis.within.encloses(one.hypothesis.u)
