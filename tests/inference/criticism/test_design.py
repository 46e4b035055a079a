"""Which experiment next: expected errors against closed forms, and designs whose best is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.design import (
    OUTCOMES,
    RIVAL_DRAWS,
    Rival,
    assess,
    naming_error,
    remaining_sd,
    suggest,
)
from bolfi_liquids.inference.criticism.study import Plan, Study
from bolfi_liquids.inference.simulations import Compute
from scipy.stats import norm

SAMPLES, SD, REPEATS = 120, 0.1, 40
WAVE, OTHER = (
    np.sqrt(2.0 / SAMPLES) * np.cos(np.pi * k * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    for k in (6, 9)
)
EVEN = {"one": Rival({}, 0.5), "other": Rival({}, 0.5)}


def two(distance, p):
    """Expected error between two Gaussians of unit variance, and of the optimal rule."""
    odds = np.log(p / (1.0 - p)) / distance
    wrong = p * norm.cdf(-distance / 2.0 - odds) + (1.0 - p) * norm.cdf(odds - distance / 2.0)
    return naming_error(distance**2 * (1.0 - np.eye(2)), np.array([p, 1.0 - p])), wrong


@pytest.mark.parametrize("distance", [0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("p", [0.5, 0.7, 0.95])
def test_the_rate_of_wrong_names_between_two_is_that_of_the_optimal_rule(distance, p):
    found, expected = two(distance, p)
    assert found == pytest.approx(expected, abs=4.0 * 0.5 / np.sqrt(2.0 * OUTCOMES))


def test_the_rate_of_wrong_names_among_several():
    """Without an experiment the most probable is named; apart in their own directions, an error
    of three is below the sum of those of pairs (union bound) and above that of any pair."""
    p = np.array([0.5, 0.3, 0.2])
    assert naming_error(np.zeros((3, 3)), p) == pytest.approx(0.5)
    even, pair = np.full(3, 1.0 / 3.0), norm.cdf(-3.0 / np.sqrt(2.0))
    found = naming_error(18.0 * (1.0 - np.eye(3)), even)
    assert pair < found < 2.0 * pair
    # two that are alike are never told apart: half of their share is lost
    alike = 100.0 * np.array([[0, 1, 1], [1, 0, 0], [1, 0, 0]])
    assert naming_error(alike, even) == pytest.approx(1.0 / 3.0, abs=1e-6)


def separations(ratio, own, shared=False):
    """Of two explanations that differ by `ratio` times all noise, their runs by `own` of it; runs
    of one seed share it."""
    noise = criticism.KnownNoise(SD * np.sqrt(1.0 - own**2))
    proposal = criticism.Proposal(len, noise, (SAMPLES,))

    def repeat(seed):
        rng = np.random.default_rng(seed)
        runs = own * SD * rng.normal(size=(2, RIVAL_DRAWS, SAMPLES))
        runs[1] = runs[0] if shared else runs[1]
        runs[1] += ratio * SD * WAVE
        return assess(proposal, EVEN, runs).snr

    return np.array([repeat(seed) for seed in range(REPEATS)])


def test_the_ratio_is_found_whatever_part_of_the_noise_the_runs_have():
    """Within a fifth: so few runs hardly know their own noise."""
    assert np.mean(separations(5.0, 0.6)) == pytest.approx(5.0, rel=0.2)
    assert np.mean(separations(10.0, 0.1)) == pytest.approx(10.0, rel=0.2)
    assert np.median(separations(0.0, 0.6)) < 3.0
    assert np.mean(separations(5.0, 0.6, shared=True)) == pytest.approx(5.0, rel=0.2)
    assert np.max(separations(0.0, 0.6, shared=True)) < 1e-6


def linear(angle):
    """Simulator in which `theta` acts along one wave, and `effect` at an angle to it."""

    def simulate(theta, seeds):
        of = {name: np.asarray(column)[:, None] for name, column in theta.items()}
        shape = np.cos(angle) * WAVE + np.sin(angle) * OTHER
        return of["theta"] * WAVE + of.get("effect", 0.0) * shape

    label = f"{angle:.2f}"
    return criticism.Proposal(simulate, criticism.KnownNoise(SD), (SAMPLES,), label, label, angle)


@pytest.fixture
def study():
    """Runs without an experiment of its own."""
    return Study(SimpleNamespace(), SimpleNamespace(), {}, Compute(batch=8), Plan())


DRAWS = SD * np.array([0.0, -3.0, 3.0])  # of a parameter
RIVALS = {
    "none": Rival({"theta": DRAWS}, 0.5),
    "effect": Rival({"theta": DRAWS, "effect": SD * np.full(3, 6.0)}, 0.5),
}


def test_the_best_of_linear_experiments_is_that_in_which_the_parameter_absorbs_nothing(study):
    """Both are as far apart at the best parameters, 6 times the noise. Along the wave of a
    parameter that is known to 3 times the noise, 6 / sqrt(1 + 3^2) is left of it."""
    along, across = linear(0.0), linear(np.pi / 2.0)
    (first, second), _ = suggest(study, [along, across], RIVALS)
    assert (first.label, second.label) == (across.label, along.label)
    assert second.snr < 3.0 and second.error > 0.1
    assert first.snr == pytest.approx(6.0, rel=0.15)
    assert first.error == pytest.approx(norm.cdf(-first.snr / 2.0), rel=0.3)
    assert (first.before, first.cost, first.between) == (0.5, np.pi / 2.0, ("none", "effect"))


def test_only_the_best_get_further_runs(study):
    """One run of each rival for every proposal, and all draws of two."""
    known = {name: Rival(one.theta | {"theta": np.zeros(3)}, 0.5) for name, one in RIVALS.items()}
    weak = {
        "none": known["none"],
        "effect": Rival({"theta": np.zeros(3), "effect": SD * np.ones(3)}, 0.5),
    }
    counted = []
    study = Study(
        study.experiment, study.prior, {}, study.compute, report=lambda *of: counted.append(of)
    )
    dead = criticism.Proposal(
        lambda theta, seeds: None, criticism.KnownNoise(SD), (SAMPLES,), "dead", "dead"
    )
    found, _ = suggest(study, [dead, *map(linear, (0.1, 0.4, 0.9, 1.3))], weak)
    assert len(found) == 2 and sum(done for _, done, _ in counted) <= 2 * (5 + 2 * 2)
    assert suggest(study, [linear(0.4)], {"none": known["none"]}) == ([], {})
    nothing, not_made = suggest(study, [dead], known)
    assert nothing == [] and list(not_made) == ["dead"]


def test_a_parameter_is_known_better_by_what_an_experiment_separates():
    """Of a line y = a x and noise 1, prior sd 2: the exact posterior sd after one value."""
    slope, prior = 3.0, 2.0
    exact = (1.0 / prior**2 + slope**2) ** -0.5
    for apart in (0.5, 4.0):
        assert prior * remaining_sd(slope * apart, apart / prior) == pytest.approx(exact)
