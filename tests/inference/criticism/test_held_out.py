"""Whether an explanation holds on other data."""

import numpy as np
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.held_out import NOISE_QUANTILE, gap, holds, predictive_gains
from bolfi_liquids.inference.criticism.measurement_noise import samples
from scipy.stats import binom, norm

ALPHA = 1e-4  # false alarms per test
SETS, RUNS, N = 100, 8, 60
NOISE = criticism.AutoregressiveNoise(np.array([0.2]), np.array([0.6]))
AT = samples(np.zeros(N))
EFFECT = np.sin(np.linspace(0.0, 6.0, N))
LAG = np.subtract.outer(np.arange(N), np.arange(N))
OWN = np.linalg.cholesky(0.1**2 * np.exp(-0.5 * (LAG / 3.0) ** 2) + 1e-12 * np.eye(N))


def noise_of(rng, count):
    return NOISE.draw(rng, AT, count)


def judged(number, *, acts, before=0.0, after=1.0, believed=NOISE):
    """The gap on data in which EFFECT acts as strongly as `acts`; models that predict `before`
    and `after` of it."""
    rng = np.random.default_rng(number)
    runs = rng.normal(size=(2 * RUNS + 1, N)) @ OWN.T
    observed = acts * EFFECT + runs[-1] + noise_of(rng, 1)[0]
    experiment = criticism.Experiment(len, observed, believed, label="other")
    return gap(experiment, before * EFFECT + runs[:RUNS], after * EFFECT + runs[RUNS:-1], number)


@pytest.fixture(scope="module")
def explained():
    return [judged(number, acts=1.0) for number in range(SETS)]


@pytest.mark.slow
def test_the_right_explanation_passes(explained):
    """But for the share that the floor sacrifices, and for what few runs get wrong."""
    assert np.mean([holds([one]) for one in explained]) > 2.0 * NOISE_QUANTILE - 1.0 - 0.02
    assert all(one.lpd_gain > 0.0 for one in explained)


@pytest.mark.slow
def test_what_noise_leaves_is_foretold(explained):
    """In root mean square: of AR(1) noise, one more run, and the mean of few runs."""
    left = np.array([one.after for one in explained])
    exact = np.sqrt(0.2**2 + 0.1**2 * (1.0 + 1.0 / RUNS))
    squares = left**2 / exact**2
    error = norm.isf(ALPHA / 2) * squares.std() / np.sqrt(SETS)
    assert abs(squares.mean() - 1.0) < error
    expected = np.array([one.noise for one in explained])
    assert abs(np.mean(expected**2) / exact**2 - 1.0) < 0.05
    beyond = sum(one.after > one.floor for one in explained)
    assert beyond <= binom.isf(ALPHA, SETS, 2.0 * (1.0 - NOISE_QUANTILE))


@pytest.mark.slow
def test_before_is_what_the_effect_leaves(explained):
    before = np.mean([one.before**2 for one in explained])
    after = np.mean([one.after**2 for one in explained])
    assert before - after == pytest.approx(np.mean(EFFECT**2), rel=0.05)


@pytest.mark.parametrize(
    ("acts", "after"), [(1.0, -1.0), (0.0, 1.0), (1.0, 2.5)], ids=["wrong way", "none", "too much"]
)
@pytest.mark.slow
def test_wrong_explanations_fail(acts, after):
    assert not any(holds([judged(number, acts=acts, after=after)]) for number in range(20))


@pytest.mark.slow
def test_a_smaller_gap_alone_proves_nothing():
    """Half of what is missing shrinks the gap and predicts better, but noise is not all that is
    left."""
    found = [judged(number, acts=2.0) for number in range(20)]
    assert all(one.after < one.before and one.lpd_gain > 3.0 for one in found)
    assert not any(holds([one]) for one in found)


@pytest.mark.slow
def test_an_explanation_that_predicts_the_same_gains_nothing():
    """However well both fit."""
    found = [judged(number, acts=0.0, after=0.0) for number in range(SETS)]
    assert np.mean([one.p_value > 0.005 for one in found]) > 0.9
    # the difference of two means of RUNS runs, whitened, is 2 / RUNS of their own noise
    assert np.mean([holds([one]) for one in found]) < 0.05


@pytest.mark.slow
def test_noise_given_too_small_refuses_the_right_explanation():
    """Most often: eight runs know their own noise, and so the floor, to some 30 %."""
    quiet = criticism.KnownNoise(0.05)
    found = [judged(number, acts=1.0, believed=quiet) for number in range(20)]
    assert np.mean([holds([one]) for one in found]) < 0.25


def error_of(freedom):
    """A simulator that is wrong by .2, as known from so many clean sets."""
    autocovariance = 0.2**2 * np.exp(-np.arange(N) / 10.0)
    return criticism.ModelError(autocovariance, freedom)


@pytest.mark.slow
def test_what_is_usual_for_a_simulator_does_not_make_it_deaf():
    """A wrong shape is seen beside a usual residual of about its size."""
    believed = criticism.SumOfNoises((NOISE, error_of(6)))
    wrong = [judged(k, acts=3.0, after=1.0, believed=believed) for k in range(20)]
    assert np.mean([holds([one]) for one in wrong]) < 0.1
    right = [judged(k, acts=3.0, after=3.0, believed=believed) for k in range(20)]
    assert all(holds([one]) for one in right)


def test_missing_samples_are_left_out():
    observed = EFFECT.copy()
    observed[20:40] = np.nan
    kept = np.isfinite(observed)
    rng = np.random.default_rng(0)
    before, after = 0.1 * rng.normal(size=(2, RUNS, 40))
    experiment = criticism.Experiment(len, observed, NOISE, label="gappy")
    found = gap(experiment, before, EFFECT[kept] + after, 0)
    expected = np.sqrt(np.mean((EFFECT[kept] - before.mean(0)) ** 2))
    assert found.label == "gappy" and found.before == pytest.approx(expected)


def test_a_gain_is_the_same_pairwise_and_among_all_where_there_is_one_other_model():
    """Of few samples in two channels, too, which are no series however many values they are."""
    rng = np.random.default_rng(0)
    before, after = rng.normal(size=(2, 4, 10, 2))
    experiment = criticism.Experiment(len, np.zeros((10, 2)), criticism.KnownNoise(0.1))
    runs = [before.reshape(4, -1), after.reshape(4, -1)]
    (among_all,) = predictive_gains([experiment, experiment], runs)
    assert gap(experiment, *runs, 0).lpd_gain == pytest.approx(among_all)


def test_the_mean_of_few_runs_is_noisy_too():
    """Of three values, whose variances are those of the runs: half as much again for two runs."""
    runs = np.random.default_rng(0).normal(size=(2, 2, 3))
    experiment = criticism.Experiment(len, np.zeros(3), criticism.KnownNoise(0.1))
    own = np.var(runs, axis=1, ddof=1).mean()
    assert gap(experiment, *runs, 0).noise ** 2 == pytest.approx(0.1**2 + 1.5 * own)
