"""The tests of a model against data, on a simulator that is linear and Gaussian."""

import itertools
from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.measurement_noise import samples
from bolfi_liquids.inference.criticism.misfit import check, locate, null_draws, scored_on_clean
from bolfi_liquids.inference.criticism.search import examine
from bolfi_liquids.inference.criticism.study import Study
from bolfi_liquids.inference.simulations import Compute
from scipy.stats import binom, kstest, norm

from bolfi_liquids import inference

pytestmark = pytest.mark.slow

ALPHA = 1e-4  # false alarms per test
BANKS, SETS = 5, 30  # emulators, and data sets for each
LEVEL = 0.05

N = 96  # values
STEPS = np.arange(N)
DESIGN = np.stack([np.ones(N), np.sin(STEPS / 15.0)], axis=1)
INSIDE = (STEPS >= 48) & (STEPS < 64)
BUMP = np.where(INSIDE, np.sin(2.0 * np.pi * (STEPS - 47.5) / 16.0), 0.0)
OWN = 0.1**2 * np.exp(-0.5 * (np.subtract.outer(STEPS, STEPS) / 3.0) ** 2) + 1e-12 * np.eye(N)
NOISE = criticism.AutoregressiveNoise(np.array([0.2]), np.array([0.6]))
WHITE = criticism.KnownNoise(0.2)
AT = samples(np.zeros(N))
PRIOR = inference.Prior({"level": dist.Uniform(-2.0, 2.0), "wave": dist.Uniform(-2.0, 2.0)})
EXTENSIONS = {"bump": criticism.Extension(dist.Uniform(-2.0, 2.0))}
WINDOWS = [
    criticism.Window({"start": start}, (STEPS >= start) & (STEPS < start + 16))
    for start in range(0, N, 16)
]


def learned(residuals, noises, same, distances=None):
    """The model error that these clean data teach."""
    far = np.zeros(len(residuals)) if distances is None else distances
    given = zip(residuals, noises, same, far, strict=True)
    return criticism.learned_model_error([criticism.CleanData(*one) for one in given])


def exact(theta, seeds):
    bump = theta.get("bump", np.zeros(len(seeds)))
    return np.stack([theta["level"], theta["wave"]], 1) @ DESIGN.T + bump[:, None] * BUMP


def noisy(theta, seeds):
    """With the simulator's own, smooth noise."""
    white = np.stack([np.random.default_rng(int(seed)).normal(size=N) for seed in seeds])
    return exact(theta, seeds) + white @ np.linalg.cholesky(OWN).T


def observe(simulate, number, bump=0.0):
    rng = np.random.default_rng([number, 1])
    theta = {"level": rng.uniform(-1.0, 1.0, 1), "wave": rng.uniform(-1.0, 1.0, 1)}
    theta["bump"] = np.array([bump])
    return simulate(theta, [10**6 + number])[0] + NOISE.draw(rng, AT, 1)[0]


def examined(simulate, observed, bank):
    experiment = criticism.Experiment(simulate, observed, NOISE)
    return examine(Study(experiment, PRIOR, EXTENSIONS, Compute(batch=64), seed=bank), None)


def on(hypothesis, observed):
    """The hypothesis with other data. Where the parameters are does not matter to what they
    leave of the data, for the simulator is linear in them."""
    moved = replace(hypothesis, difference=observed - hypothesis.expected(hypothesis.u)[0])
    # what was computed of the covariance and the slopes stays as it is
    vars(moved).update({name: getattr(hypothesis, name) for name in ("factor", "tangents")})
    return moved


@pytest.fixture(scope="module")
def banks():
    return [examined(noisy, observe(noisy, bank), bank) for bank in range(BANKS)]


def checks(banks, noise, bump=0.0):
    """Of all data sets, by a model that believes in `noise`."""
    found = []
    for bank, base in enumerate(banks):
        believed = replace(base.hypothesis, noise=noise.covariance(AT))
        null = null_draws(believed, noise, np.random.default_rng(bank))
        for number in range(SETS):
            observed = observe(noisy, 1000 * (bank + 1) + number, bump)
            found.append(check(on(believed, observed), base.signatures, null))
    return found


def too_many(p_values):
    """Alarms beyond what chance allows at LEVEL."""
    return np.sum(np.array(p_values) < LEVEL) > binom.isf(ALPHA, len(p_values), LEVEL)


@pytest.fixture(scope="module")
def nulls(banks):
    return checks(banks, NOISE)


def test_p_values_of_a_right_model_are_uniform(nulls):
    """150 of them: a distribution function off by .18 is found."""
    for kind in ("p_value", "p_score", "p_smooth"):
        p_values = [getattr(one, kind) for one in nulls]
        assert kstest(p_values, "uniform").pvalue > ALPHA, kind
        assert not too_many(p_values), kind
    scores = [one.scores["bump"] for one in nulls]
    assert kstest(scores, "norm").pvalue > ALPHA


def test_where_no_direction_is_left_the_slow_part_alone_decides(banks):
    """Ties of nothing with nothing are no evidence, for a right model nor against it."""
    base = banks[0]
    found = check(on(base.hypothesis, observe(noisy, 7, 1.0)), {}, base.null)
    assert found.p_score == 1.0
    assert found.p_value == pytest.approx(found.p_smooth, abs=1.5e-3)  # one draw more or less


def test_taking_correlated_noise_for_white_is_caught(banks):
    """Of the same variance; its slow part is up to four times as large as believed."""
    p_values = [one.p_value for one in checks(banks, WHITE)]
    assert kstest(p_values, "uniform").pvalue < ALPHA
    assert too_many(p_values)
    assert np.mean(np.array(p_values) < LEVEL) > 4.0 * LEVEL


def test_an_effect_is_found_and_its_score_says_how_large_it_is(banks):
    found = checks(banks, NOISE, bump=0.5)
    assert np.mean([one.p_value < LEVEL for one in found]) > 0.9
    length = closed_form(np.zeros(N), OWN)[1]
    scores = np.array([one.scores["bump"] for one in found])
    error = norm.isf(ALPHA / 2) / np.sqrt(len(scores))
    # the covariance of the own noise is learned from 40 runs, so the length is, too
    assert abs(scores.mean() / (0.5 * length) - 1.0) < 0.1 + error / (0.5 * length)


def closed_form(observed, own):
    """The bump's score by generalised least squares, and that of a bump of size one."""
    root = np.linalg.inv(np.linalg.cholesky(NOISE.covariance(AT) + own))
    base = np.linalg.qr(root @ DESIGN)[0]
    left = root @ BUMP - base @ (base.T @ (root @ BUMP))
    length = np.linalg.norm(left)
    return left @ root @ observed / length, length


def test_scores_are_those_of_generalised_least_squares():
    """Of a simulator without noise, which the emulator follows to 1 % of the noise."""
    for number in range(3):
        observed = observe(exact, number, bump=0.1 * number)
        base = examined(exact, observed, number)
        expected = closed_form(observed, np.zeros((N, N)))[0]
        assert base.check.scores["bump"] == pytest.approx(expected, abs=0.02)


def located(banks, bump):
    """p-values [data sets, windows]."""
    p_values = []
    for bank, base in enumerate(banks):
        for number in range(SETS):
            hypothesis = on(base.hypothesis, observe(noisy, 1000 * (bank + 1) + number, bump))
            p_values.append([found.p_value for found in locate(hypothesis, WINDOWS, base.null)])
    return np.array(p_values)


def test_all_windows_share_one_error_rate(banks):
    least = located(banks, 0.0).min(1)
    assert not too_many(least)
    assert np.mean(least < 0.5) > 0.3  # and are not merely deaf


def test_the_window_in_which_the_data_differ_is_found(banks):
    p_values = located(banks, 1.5)
    assert np.mean(p_values.argmin(1) == 3) > 0.9
    assert np.mean(p_values[:, 3] < LEVEL) > 0.9
    assert not too_many(p_values[:, [0, 1, 5]].min(1))


def test_clean_data_are_scored_by_what_the_others_teach(banks):
    """Against generalised least squares, which knows the design and not the emulator."""
    base = banks[0]
    silent = criticism.KnownNoise(0.0)
    shapes = [1.5 * BUMP, 0.3 * np.cos(STEPS / 5.0) - 0.8 * BUMP, 0.4 * np.sin(STEPS / 9.0)]
    clean, repeats = [shape[:, None] for shape in shapes], [True, True, False]
    scores = []
    for k in range(2):
        left, again = np.delete(clean, k, axis=0), np.delete(repeats, k)
        taught = learned(list(left), [silent] * 2, list(again))
        unexpected = shapes[k] - taught.mean(AT)
        weight = np.linalg.inv(
            base.hypothesis.spread + NOISE.covariance(AT) + taught.covariance(AT)
        )
        absorbed = weight @ DESIGN
        weight -= absorbed @ np.linalg.solve(DESIGN.T @ absorbed, absorbed.T)
        change = base.signatures["bump"].change
        scores.append(change @ weight @ unexpected / np.sqrt(change @ weight @ change))
    size = np.sqrt((1.0 + np.sum(np.square(scores))) / 3.0)
    assert size > 1.5
    usual = learned(clean, [silent] * 3, repeats)
    noise = criticism.SumOfNoises((NOISE, usual))
    believed = replace(base.hypothesis, noise=noise.covariance(AT))
    found = scored_on_clean(believed, noise, base.signatures)
    assert found["bump"].clean == pytest.approx(size, rel=0.02)


def test_a_clean_set_alone_says_nothing_of_scores(banks):
    base = banks[0]
    usual = learned([BUMP[:, None]], [criticism.KnownNoise(0.0)], [True])
    for noise in (NOISE, criticism.SumOfNoises((NOISE, usual))):
        assert scored_on_clean(base.hypothesis, noise, base.signatures)["bump"].clean == 1.0


def test_what_clean_data_show_as_well_is_no_discovery(banks):
    base = banks[0]
    wrong = on(base.hypothesis, observe(noisy, 7, 1.0))
    alone = check(wrong, base.signatures, base.null)
    clean = base.signatures["bump"]._replace(clean=abs(alone.scores["bump"]))
    beside = check(wrong, {"bump": clean}, base.null)
    assert alone.p_score < 0.01
    assert abs(beside.scores["bump"]) == pytest.approx(1.0)
    assert beside.p_score == pytest.approx(2.0 * norm.sf(1.0), abs=0.06)  # of 999 draws
    assert beside.p_smooth == alone.p_smooth


def test_a_prior_says_on_which_side_an_effect_can_act():
    for low, high, side in ((-2.0, 2.0, 0), (0.0, 2.0, 1), (-2.0, 0.0, -1)):
        extensions = {"bump": criticism.Extension(dist.Uniform(low, high))}
        data = criticism.Experiment(exact, observe(exact, 3), NOISE)
        found = examine(Study(data, PRIOR, extensions, Compute(batch=64)), None).signatures
        assert found["bump"].side == side
        assert found["bump"].change @ BUMP > 0.0  # towards a greater coefficient, on either side


def test_an_effect_is_scored_on_the_side_on_which_it_can_act(banks):
    base = banks[0]
    both = base.signatures["bump"]
    assert both.side == 0  # the prior allows either
    for bump, side in itertools.product((-1.0, 1.0), (-1, 1)):
        wrong = on(base.hypothesis, observe(noisy, 7, bump))
        found = check(wrong, {"bump": both._replace(side=side)}, base.null).p_score
        assert found < 0.01 if bump * side > 0.0 else found > 0.5
