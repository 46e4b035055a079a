"""Where models are simulated and fitted, what a coarse emulator adds, and where windows lie."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.hypothesis import (
    hypothesise,
    values_of,
    weighted_posterior,
)
from bolfi_liquids.inference.criticism.measurement_noise import samples
from bolfi_liquids.inference.criticism.misfit import locate, null_draws
from bolfi_liquids.inference.criticism.runs import PriorBox, sides
from bolfi_liquids.inference.criticism.search import examine, explain
from bolfi_liquids.inference.criticism.study import Study
from bolfi_liquids.inference.simulations import Compute
from bolfi_liquids.inference.surrogates import output_vectors
from scipy.stats import binom, chi2, norm

from bolfi_liquids import inference

ALPHA = 1e-4  # false alarms per test
EMULATORS, RUNS = 20, 8
LEVEL = 0.05
TIME = np.linspace(0.0, 3.0, 40)
PRIOR = inference.Prior({"rate": dist.Uniform(2.0, 6.0)})
EXTENSIONS = {"offset": criticism.Extension(dist.Normal(0.0, 1.0))}
NOISE = criticism.KnownNoise(0.01)


def oscillate(theta, seeds):
    """Without noise: what an emulator errs by, it does for want of runs."""
    return np.cos(theta["rate"][:, None] * TIME) * np.exp(-0.3 * TIME)


def fitted(simulate, observed, noise, bank, count=RUNS):
    experiment = criticism.Experiment(simulate, observed, noise)
    study = Study(experiment, PRIOR, EXTENSIONS, Compute(batch=64), seed=bank)
    runs = study.run("start", PriorBox.whole(1).fill(PRIOR, bank, count))
    return hypothesise((), PRIOR, runs, observed, noise, PriorBox.whole(1))


@pytest.fixture(scope="module")
def coarse():
    """Hypotheses on as many emulators, each with data of another truth."""
    found = []
    for bank in range(EMULATORS):
        rng = np.random.default_rng(bank)
        clean = oscillate({"rate": rng.uniform(2.5, 5.5, 1)}, [0])[0]
        observed = clean + NOISE.draw(rng, samples(clean), 1)[0]
        found.append(fitted(oscillate, observed, NOISE, bank))
    return found


def alarms(hypotheses, spread):
    """Of a chi-square test at LEVEL of what the parameters leave."""
    count = 0
    for one in hypotheses:
        root = np.linalg.inv(np.linalg.cholesky(one.noise + (one.spread if spread else 0.0)))
        basis = np.linalg.qr(root @ one.factor @ one.tangents)[0]
        left = root @ one.difference
        left = left - basis @ (basis.T @ left)
        count += np.sum(left**2) > chi2.isf(LEVEL, len(left) - basis.shape[1])
    return count


@pytest.mark.slow
def test_a_coarse_emulators_error_is_reckoned_with(coarse):
    """Without it a right model would be refused in half of all cases."""
    limit = binom.isf(ALPHA, EMULATORS, LEVEL)
    assert alarms(coarse, spread=True) <= limit
    assert alarms(coarse, spread=False) > limit


@pytest.mark.slow
def test_a_run_that_blew_up_is_left_out():
    def seldom(theta, seeds):
        signals = oscillate(theta, seeds)
        signals[0] += 1e9
        return signals

    observed = oscillate({"rate": np.array([4.0])}, [0])[0]
    found = fitted(seldom, observed, NOISE, 0, count=12)
    assert found.fit.training_mask.sum() == 11
    assert found.best["rate"] == pytest.approx(4.0, abs=0.1)


# Two channels, neighbouring samples averaged as in a long series.

SHAPE = (60, 2)
SD = np.array([0.15, 0.2])


def tilted(theta, seeds):
    rate = theta["rate"][:, None]
    time = np.linspace(0.0, 3.0, SHAPE[0])
    return np.stack([np.cos(rate * time), np.sin(rate * time)], -1)


def window(start, end, channels=slice(None)):
    chosen = np.zeros(SHAPE, bool)
    chosen[start:end, channels] = True
    return criticism.Window({"start": start}, chosen)


@pytest.fixture(scope="module")
def averaged():
    """A hypothesis on values of three samples each; what was observed has a gap, and an offset of
    the second channel from sample 30 to 45."""
    rng = np.random.default_rng(0)
    observed = tilted({"rate": np.array([4.0])}, [0])[0] + SD * rng.normal(size=SHAPE)
    observed[30:45, 1] += 0.5
    observed[10:16, 0] = np.nan
    here = np.isfinite(observed).ravel()
    noise = criticism.KnownNoise(np.tile(SD, SHAPE[0])[here])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(output_vectors, "MAX_VALUES", 40)
        return fitted(tilted, observed, noise, 0, count=16), noise


@pytest.mark.slow
def test_noise_is_averaged_like_the_output(averaged):
    """A draw's place in the flattened output is not that of its value."""
    hypothesis, noise = averaged
    at = samples(hypothesis.fit.observed)
    drawn = values_of(hypothesis.surrogate.output, noise.draw(np.random.default_rng(0), at, 20_000))
    layout, counts = hypothesis.layout, hypothesis.surrogate.output.counts
    assert counts.max() == 3 and set(layout.channel) == {0, 1}
    expected = SD[layout.channel] ** 2 / counts
    np.testing.assert_allclose(np.diag(hypothesis.noise), expected, rtol=1e-9)
    error = norm.isf(ALPHA / 2 / len(expected)) * np.sqrt(2.0 / 20_000)
    np.testing.assert_allclose(drawn.var(0), expected, rtol=error)


@pytest.mark.slow
def test_windows_of_averaged_values_and_of_single_samples_are_looked_at(averaged):
    hypothesis, noise = averaged
    null = null_draws(hypothesis, noise, np.random.default_rng(0))
    windows = [window(30, 45, 1), window(36, 37, 1), window(0, 9), window(12, 14, 0)]
    # of the last one nothing was observed
    planted, single, other = locate(hypothesis, windows, null)
    assert max(planted.p_value, single.p_value) < LEVEL < other.p_value
    error = 5.0 * SD[1]
    assert planted.rms == pytest.approx(0.5, abs=error / np.sqrt(15))
    assert single.rms == pytest.approx(0.5, abs=error / np.sqrt(3))


@pytest.mark.slow
def test_the_mean_of_a_window_is_over_all_its_channels(averaged):
    """The first channel alone is where it should be."""
    hypothesis, noise = averaged
    null = null_draws(hypothesis, noise, np.random.default_rng(0))
    both, second, first = locate(
        hypothesis, [window(30, 45), window(30, 45, 1), window(30, 45, 0)], null
    )
    weights = SD**-2 / np.sqrt(np.sum(SD**-2))
    expected = weights @ (SD * [first.z, second.z])
    assert abs(first.z) < 4.0 < second.z
    assert both.z == pytest.approx(expected, abs=0.5)


# Noise of uncertain size.


def level(theta, seeds):
    return np.tile(theta["level"][:, None], (1, 30))


@pytest.mark.slow
@pytest.mark.parametrize("size", [1.0, 4.0], ids=["as large as learned", "four times as large"])
def test_a_posterior_allows_for_what_is_not_known_of_the_model_errors_size(size):
    """White residuals whose variance is known as from 3 numbers: the level's posterior is Student's
    t, and as wide as the residuals that are seen."""
    rng, n, sd, freedom = np.random.default_rng(0), 30, 0.05, 3
    prior = inference.Prior({"level": dist.Uniform(-2.0, 2.0)})
    usual = criticism.ModelError(np.append(sd**2, np.zeros(n - 1)), freedom)
    noise = criticism.SumOfNoises((criticism.KnownNoise(1e-4), usual))
    observed = 0.3 + size * sd * rng.normal(size=n)
    experiment = criticism.Experiment(level, observed, noise)
    runs = Study(experiment, prior, EXTENSIONS, Compute(batch=64)).run(
        "start", PriorBox.whole(1).fill(prior, 0, 12)
    )
    found = weighted_posterior(hypothesise((), prior, runs, observed, noise, PriorBox.whole(1)))
    draws, weights = found.theta["level"], found.weights
    spread = np.sqrt(np.average((draws - np.average(draws, weights=weights)) ** 2, weights=weights))
    squares = freedom * sd**2 + np.sum((observed - observed.mean()) ** 2)
    expected = np.sqrt(squares / (freedom + n - 3) / n)
    assert spread == pytest.approx(expected, rel=0.1)
    assert np.average(draws, weights=weights) == pytest.approx(observed.mean(), abs=0.1 * expected)


# Where a model is simulated.

RISE = np.linspace(0.0, 1.0, 40)
LEVEL_PRIOR = inference.Prior({"level": dist.Uniform(-2.0, 2.0)})
RAMPS = {"ramp": criticism.Extension(dist.Uniform(-2.0, 2.0))}
QUIET = criticism.KnownNoise(0.02)


def ramp(theta, seeds):
    """An effect that a model without it takes for another level."""
    size = theta.get("ramp", np.zeros(len(seeds)))
    return theta["level"][:, None] + size[:, None] * (1.0 + 0.5 * RISE**2)


def study_of(data):
    experiment = criticism.Experiment(ramp, data, QUIET)
    return Study(experiment, LEVEL_PRIOR, RAMPS, Compute(batch=64))


def ramped(level, size=0.0):
    theta = {"level": np.array([level]), "ramp": np.array([size])}
    return ramp(theta, [0])[0] + 0.02 * np.random.default_rng(0).normal(size=len(RISE))


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


def test_effects_are_tried_on_both_sides_of_neutral_or_on_the_only_one():
    for low, high, expected in (
        (-1.0, 1.0, [-0.6, 0.6, -0.3, 0.3]),
        (0.0, 1.0, [0.6, 0.3, 0.2, 0.15]),
        (-1.0, 0.0, [-0.6, -0.3, -0.2, -0.15]),
        (-1.0, 3.0, [-0.6, 1.8, -0.3, 0.9]),
    ):
        found = sides(criticism.Extension(dist.Uniform(low, high)), 4, 0.6)
        np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.slow
def test_best_fit_and_posterior_stay_where_the_model_was_simulated():
    """Data that lie beyond draw both to the end and no further."""
    within = PriorBox(np.array([0.2]), np.array([0.5]))
    study = study_of(ramped(1.5))
    runs = study.run("start", within.fill(LEVEL_PRIOR, 0, 12))
    found = study.hypothesis((), runs, within)
    assert found.u[0] == pytest.approx(0.5, abs=0.01)
    level = weighted_posterior(found).draw(0, 200)["level"]
    assert level.max() < 4.0 * 0.55 - 2.0


@pytest.mark.slow
def test_a_truth_outside_of_the_box_of_the_model_without_the_effect_is_reached():
    """The base model fits best at 1.6, half of the prior's range away."""
    study = study_of(ramped(0.0, 1.4))
    base = examine(study, None)
    assert not base.box.encloses(np.array([0.5]))
    found, _ = explain(study, base)
    (one,) = (candidate for candidate in found if candidate.accepted)
    assert one.hypothesis.best == pytest.approx({"level": 0.0, "ramp": 1.4}, abs=0.1)
    assert one.hypothesis.within.encloses(one.hypothesis.u)
